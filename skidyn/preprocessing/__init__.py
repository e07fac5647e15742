# SPDX-License-Identifier: BSD-3-Clause
"""Transformers that keep the number of rows, and functions on logs that change it."""

from skidyn.preprocessing._current import CurrentToTorque
from skidyn.preprocessing._delay import DelayEstimate, advance_channels, estimate_delay
from skidyn.preprocessing._derivatives import SmoothDerivatives
from skidyn.preprocessing._drop_keys import DropKeys
from skidyn.preprocessing._logs import average_repetitions, cross_fitted_residual
from skidyn.preprocessing._signals import ButterworthFilter, SignalScaler, TimeDerivative

__all__ = [
    "ButterworthFilter",
    "CurrentToTorque",
    "DelayEstimate",
    "DropKeys",
    "SignalScaler",
    "SmoothDerivatives",
    "TimeDerivative",
    "advance_channels",
    "average_repetitions",
    "cross_fitted_residual",
    "estimate_delay",
]

# For other packages of skidyn; no part of the public interface.
from skidyn.preprocessing._affine import scaling_of as scaling_of
from skidyn.preprocessing._drop_keys import without_keys_inside as without_keys_inside
