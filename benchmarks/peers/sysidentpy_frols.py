# SPDX-License-Identifier: BSD-3-Clause
"""SysIdentPy: polynomial terms of the signals by FROLS, their number by a Bayesian criterion.

The residual of the base model depends on the present signals, so the model is static (NFIR, second
degree, no lags). The numbers of rows and signals are reduced so that FROLS takes seconds.
"""

import numpy as np
from _answers import by_signals
from sysidentpy.basis_function import Polynomial
from sysidentpy.model_structure_selection import FROLS
from sysidentpy.parameter_estimation import LeastSquares

PACKAGE = "sysidentpy"


class Terms:
    """Polynomial terms of standardised signals."""

    def fit(self, X, y):
        self.middle, self.spread = X.mean(axis=0), np.maximum(X.std(axis=0), 1e-9)
        self.model = FROLS(
            order_selection=True,
            n_info_values=12,
            info_criteria="bic",
            xlag=[[1]] * X.shape[1],
            model_type="NFIR",
            basis_function=Polynomial(degree=2),
            estimator=LeastSquares(),
        )
        self.model.fit(X=self._late(X), y=self._padded(y)[:, None])
        return self

    def predict(self, X):
        told = self.model.predict(X=self._late(X), y=np.zeros((len(X) + 1, 1)))
        return np.ravel(told)[1:]

    def _late(self, X):
        """Signals moved up by one row, since the smallest lag of SysIdentPy is one row."""
        Z = (X - self.middle) / self.spread
        return np.vstack([Z, Z[-1:]])

    @staticmethod
    def _padded(y):
        return np.concatenate([[0.0], y])


def answer(log, robot) -> dict:
    return by_signals(log, Terms, most=800)
