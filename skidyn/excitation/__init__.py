# SPDX-License-Identifier: BSD-3-Clause
"""Excitation: motions from which the parameters of a robot can be told."""

from skidyn.excitation._design import Excitation, MotionLimits, design_excitation

__all__ = [
    "Excitation",
    "MotionLimits",
    "design_excitation",
]
