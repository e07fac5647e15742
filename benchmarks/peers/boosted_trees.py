# SPDX-License-Identifier: BSD-3-Clause
"""Boosted trees on the residual of the base model, with permutation importance."""

from _answers import by_signals
from sklearn.ensemble import HistGradientBoostingRegressor

PACKAGE = "scikit-learn"


def answer(log, robot) -> dict:
    return by_signals(log, lambda: HistGradientBoostingRegressor(max_iter=80, random_state=0))
