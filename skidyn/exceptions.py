# SPDX-License-Identifier: BSD-3-Clause
"""Errors and warnings of skidyn; every error is a ValueError that states how to fix the input."""

from skidyn._exceptions import (
    ColumnError,
    EffectError,
    LogError,
    LogWarning,
    MisreadLogError,
    RobotDescriptionError,
    RobotDescriptionWarning,
    SkidynError,
)

__all__ = [
    "ColumnError",
    "EffectError",
    "LogError",
    "LogWarning",
    "MisreadLogError",
    "RobotDescriptionError",
    "RobotDescriptionWarning",
    "SkidynError",
]
