# SPDX-License-Identifier: BSD-3-Clause
"""Physical models with a learner for their residual."""

from skidyn.hybrid._hybrid import HybridRegressor
from skidyn.hybrid._own_joint import OwnJointRegressor

__all__ = ["HybridRegressor", "OwnJointRegressor"]

# For other packages of skidyn; no part of the public interface.
from skidyn.hybrid._gate import learned_weights as learned_weights
from skidyn.hybrid._range import (
    TrainingRange as TrainingRange,
    distances as distances,
    fade as fade,
)
