# SPDX-License-Identifier: BSD-3-Clause
"""Errors and warnings of skidyn; every error is a ValueError that says how to mend the input."""

from __future__ import annotations


class SkidynError(ValueError):
    """Root of skidyn's errors."""


class ColumnError(SkidynError):
    """Columns of X or of a log do not follow the contract."""


class EffectError(SkidynError):
    """An effect is unknown or does not fit the robot or the signals."""


class LogError(SkidynError):
    """A log cannot be used as it is."""


class RobotDescriptionError(SkidynError):
    """A URDF cannot be turned into a robot."""


class LogWarning(UserWarning):
    """A log can be used, but something about it looks wrong; the message holds the evidence."""


class RobotDescriptionWarning(UserWarning):
    """A URDF can be used, but something in it is physically impossible."""
