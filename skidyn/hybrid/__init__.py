# SPDX-License-Identifier: BSD-3-Clause
"""Physics with a learner on what it leaves over."""

from skidyn.hybrid._hybrid import HybridRegressor
from skidyn.hybrid._own_joint import OwnJointRegressor

__all__ = ["HybridRegressor", "OwnJointRegressor"]
