# SPDX-License-Identifier: BSD-3-Clause
"""Prediction of a log that arrives in parts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._signals import Array
from skidyn._validation import validate_motion

if TYPE_CHECKING:
    from skidyn.neural_network._base import SequenceRegressor


class TorqueStream:
    """Predict new rows of a log, keeping only the part of the past that the network uses.

    Parameters
    ----------
    estimator : estimator
        A fitted recurrent regressor, whose ``stream`` method makes this object.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.neural_network import LSTMRegressor
    >>> X = np.random.default_rng(0).normal(size=(50, 2))
    >>> model = LSTMRegressor(window=5, max_epochs=1, random_state=0).fit(X, X[:, 0])
    >>> stream = model.stream()
    >>> parts = [stream.predict(X[i : i + 7]) for i in range(0, 50, 7)]
    >>> bool(np.allclose(np.concatenate(parts), model.predict(X), atol=1e-6))
    True
    """

    def __init__(self, estimator: SequenceRegressor) -> None:
        self._estimator = estimator
        self._past = np.empty((0, estimator.n_features_in_))

    def predict(self, X: Any) -> Array:
        """Predict the next rows.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_new_samples, n_features)
            Rows that follow those of the last call.

        Returns
        -------
        y : ndarray of shape (n_new_samples,) or (n_new_samples, n_outputs), N m (N if prismatic)
            Their torque, equal to that of ``predict`` for the whole log.
        """
        estimator = self._estimator
        new = validate_motion(estimator, X, reset=False, dtype=np.float64)
        log = np.concatenate([self._past, new])
        torque = estimator._predict_array(log)[len(self._past) :]
        last = estimator._keys().segments(log)[-1]
        # the current piece and the history before it; cut at the edge of a piece to keep the grid
        window, stride = estimator.window, estimator.stride
        n_pieces = (last.stop - last.start) // stride - -(-window // stride)
        keep_from = last.start + max(0, n_pieces) * stride
        self._past = log[keep_from:]
        return torque
