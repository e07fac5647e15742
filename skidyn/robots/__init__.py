# SPDX-License-Identifier: BSD-3-Clause
"""Robots read from URDF, SDF or MJCF, with batched rigid-body dynamics and base parameters."""

from skidyn.robots._base_parameters import BaseParameters, find_base_parameters
from skidyn.robots._robot import Robot

__all__ = ["BaseParameters", "Robot", "find_base_parameters"]

# For other packages of skidyn; no part of the public interface.
from skidyn.robots._base_parameters import (
    base_parameter_index as base_parameter_index,
    with_whole_turns as with_whole_turns,
)
from skidyn.robots._symbols import (
    Instant as Instant,
    SymbolicRobot as SymbolicRobot,
    Symbols as Symbols,
    filled as filled,
    replay as replay,
    symbols as symbols,
)
