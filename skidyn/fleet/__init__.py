# SPDX-License-Identifier: BSD-3-Clause
"""Many robots of one type: what they share, which deviates in which effect, and since when."""

from skidyn.fleet._deviation import FleetComparison, compare_fleet
from skidyn.fleet._drift import DriftReport, monitor_drift

__all__ = ["DriftReport", "FleetComparison", "compare_fleet", "monitor_drift"]
