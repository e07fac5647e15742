# SPDX-License-Identifier: BSD-3-Clause
"""Excitation: motions from which the parameters of a robot can be identified."""

from skidyn.excitation._design import design_excitation
from skidyn.excitation._excitation import Excitation
from skidyn.excitation._limits import MotionLimits

__all__ = [
    "Excitation",
    "MotionLimits",
    "design_excitation",
]

# For other packages of skidyn; no part of the public interface.
from skidyn.excitation._fourier import (
    fourier as fourier,
    product as product,
    rest_window as rest_window,
)
