# SPDX-License-Identifier: BSD-3-Clause
"""Errors of a torque model per joint, the papers' tables, and intervals over recordings."""

from skidyn.metrics._drift import Drift, drift
from skidyn.metrics._errors import (
    SCORERS,
    joint_error_table,
    joint_scores,
    max_absolute_error,
    min_absolute_error,
    percent_improvement,
    rmse_over_range,
)
from skidyn.metrics._paired import PairedComparison, paired_comparison, trajectory_errors

__all__ = [
    "SCORERS",
    "Drift",
    "PairedComparison",
    "drift",
    "joint_error_table",
    "joint_scores",
    "max_absolute_error",
    "min_absolute_error",
    "paired_comparison",
    "percent_improvement",
    "rmse_over_range",
    "trajectory_errors",
]
