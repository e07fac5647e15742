# SPDX-License-Identifier: BSD-3-Clause
"""Fleets of robots of one type: common coefficients, deviating robots and drifts over time."""

from skidyn.fleet._deviation import FleetComparison, compare_fleet
from skidyn.fleet._drift import DriftReport, monitor_drift

__all__ = ["DriftReport", "FleetComparison", "compare_fleet", "monitor_drift"]
