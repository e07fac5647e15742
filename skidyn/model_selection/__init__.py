# SPDX-License-Identifier: BSD-3-Clause
"""Cross-validation by recordings, and a guard against leaking splits."""

from skidyn.model_selection._leakage import LeakageGuard, LeakageWarning, leakage_report
from skidyn.model_selection._learning_curve import trajectory_learning_curve
from skidyn.model_selection._split import PhaseKFold, TrajectoryKFold

__all__ = [
    "LeakageGuard",
    "LeakageWarning",
    "PhaseKFold",
    "TrajectoryKFold",
    "leakage_report",
    "trajectory_learning_curve",
]

# For other packages of skidyn; no part of the public interface.
from skidyn.model_selection._shuffled import order_of_log as order_of_log
from skidyn.model_selection._split import held_out_folds as held_out_folds
