# SPDX-License-Identifier: BSD-3-Clause
"""gplearn: a formula for the residual of the base model, found by genetic programming."""

import numpy as np
from _answers import by_signals
from gplearn.genetic import SymbolicRegressor

PACKAGE = "gplearn"


def make() -> SymbolicRegressor:
    return SymbolicRegressor(
        population_size=400,
        generations=12,
        function_set=("add", "sub", "mul", "div", "sin", "cos", "abs", "neg"),
        const_range=(-3.0, 3.0),
        parsimony_coefficient=0.002,
        metric="mse",
        max_samples=0.9,
        random_state=0,
    )


class Formula:
    """Formula of signals in units of their standard deviation."""

    def fit(self, X, y):
        self.spread = np.maximum(X.std(axis=0), 1e-9)
        self.model = make().fit(X / self.spread, y)
        return self

    def predict(self, X):
        return self.model.predict(X / self.spread)


def answer(log, robot) -> dict:
    return by_signals(log, Formula, most=800)
