# SPDX-License-Identifier: BSD-3-Clause
"""Recurrent networks for inverse dynamics: LSTM, NDL, SDL and BLL."""

from skidyn.neural_network._bll import BLLRegressor
from skidyn.neural_network._lstm import LSTMRegressor, NDLRegressor
from skidyn.neural_network._sdl import SDLRegressor
from skidyn.neural_network._stream import TorqueStream

__all__ = [
    "BLLRegressor",
    "LSTMRegressor",
    "NDLRegressor",
    "SDLRegressor",
    "TorqueStream",
]
