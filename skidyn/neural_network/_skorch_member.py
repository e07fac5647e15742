# SPDX-License-Identifier: BSD-3-Clause
"""A skorch network as a scikit-learn regressor."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, MetaEstimatorMixin, RegressorMixin, clone
from sklearn.utils import check_random_state


class SkorchMember(MetaEstimatorMixin, RegressorMixin, BaseEstimator):
    """A skorch net that accepts tables in double precision, and targets of one or two dimensions.

    skorch casts nothing. A net whose output has one column is trained wrongly, without an error, on
    one-dimensional targets (its loss subtracts every target from every output). ``random_state`` is
    the seed of initial weights and of the order of rows.
    """

    def __init__(self, net: Any, random_state: Any = None) -> None:
        self.net = net
        self.random_state = random_state

    def fit(self, X: Any, y: Any) -> SkorchMember:
        """Train a copy of the net."""
        inputs = np.asarray(X, dtype=np.float32)
        targets = np.asarray(y, dtype=np.float32)
        self._one_dimensional = targets.ndim == 1
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(int(check_random_state(self.random_state).randint(2**31 - 1)))
            self.net_ = clone(self.net).fit(inputs, targets.reshape(len(targets), -1))
        return self

    def predict(self, X: Any) -> NDArray[np.float64]:
        """Output of the net."""
        output = np.asarray(self.net_.predict(np.asarray(X, dtype=np.float32)), dtype=np.float64)
        return output[:, 0] if self._one_dimensional else output
