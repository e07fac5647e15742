# SPDX-License-Identifier: BSD-3-Clause
"""Table of a forecasting problem, persistence and linear autoregression."""

from __future__ import annotations

from numbers import Integral, Real
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.linear_model import Ridge
from sklearn.utils import Bunch
from sklearn.utils.validation import check_is_fitted, validate_data

from skidyn._columns import ColumnSpec
from skidyn._compat import Interval, fit_context
from skidyn._keys import fitted_keys
from skidyn._order import refuse_shuffled, taken, time_order
from skidyn._signals import find_segments

Array = NDArray[np.float64]


def forecast_table(
    signal: ArrayLike, trajectory: ArrayLike | None = None, *, time: Any = None
) -> Bunch:
    """Turn a signal into a regression problem: predict each sample from the one before.

    Parameters
    ----------
    signal : array-like of shape (n_samples,) or (n_samples, n_signals)
        For example the residual of a physical model, N m.
    trajectory : array-like of shape (n_samples,), default=None
        Trajectory number of every row.
    time : array-like of shape (n_samples,), s, default=None
        Gaps in it separate segments.

    Returns
    -------
    table : Bunch
        ``X`` of shape (n_rows, 1 + n_signals): number of the segment, then the previous sample (so
        that the estimators have ``trajectory=0``); ``y`` of shape (n_rows, n_signals): the sample;
        ``rows``: their rows in `signal`. The first row of a segment has no past and is left out.

    Raises
    ------
    ValueError
        The signal is empty or not finite, the lengths differ, or the rows are not in the order of
        trajectory and time.

    Examples
    --------
    >>> from skidyn.forecasting import forecast_table
    >>> table = forecast_table([1.0, 2.0, 3.0], [0, 0, 0])
    >>> table.X.tolist(), table.y.tolist()
    ([[0.0, 1.0], [0.0, 2.0]], [[2.0], [3.0]])
    """
    values = np.asarray(signal, dtype=np.float64)
    if len(values) == 0:
        raise ValueError("signal has no samples; a forecast needs two of a trajectory at least.")
    values = values.reshape(len(values), -1)
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if len(bad):
        raise ValueError(f"signal is not finite in row {bad[0]}; remove such rows first.")
    labels = np.zeros(len(values)) if trajectory is None else np.asarray(trajectory)
    clock = None if time is None else np.asarray(time, dtype=float)
    for name, given in (("trajectory", labels), ("time", clock)):
        if given is not None and given.shape != (len(values),):
            raise ValueError(
                f"{name} has shape {given.shape}; one value for each of the {len(values)} samples "
                "of signal is expected."
            )
    refuse_shuffled("forecast_table", labels, clock)
    segments = find_segments(labels, clock)
    rows = np.concatenate([np.arange(s.start + 1, s.stop) for s in segments])
    if len(rows) == 0:
        raise ValueError(
            "no sample has another one of its trajectory right before it; sort the rows by "
            "trajectory and time."
        )
    number = np.concatenate([np.full(s.stop - s.start - 1, k) for k, s in enumerate(segments)])
    return Bunch(X=np.c_[number, values[rows - 1]], y=values[rows], rows=rows)


class _Forecaster(MultiOutputMixin, RegressorMixin, BaseEstimator):
    """Checks that the past of every output is among the features."""

    trajectory: ColumnSpec
    time: ColumnSpec

    def _past(self, X: Array) -> Array:
        """Previous sample of each row, one column per output."""
        return X[:, list(fitted_keys(self).features)]

    def _check(self, X: Any, y: Any) -> tuple[Array, Array]:
        X, y = validate_data(self, X, y, multi_output=True, y_numeric=True, dtype=np.float64)
        self._one_dimensional = y.ndim == 1
        targets = y.reshape(len(y), -1)
        n_past = self._past(X).shape[1]
        if n_past != targets.shape[1]:
            raise ValueError(
                f"X holds the past of {n_past} signals and y has {targets.shape[1]}; use "
                "forecast_table to make both."
            )
        return X, targets

    def _shaped(self, forecast: Array) -> Array:
        return forecast[:, 0] if self._one_dimensional else forecast


class PersistenceRegressor(_Forecaster):
    """Persistence forecast: each sample equals the previous one.

    Parameters
    ----------
    trajectory, time : int, str or None, default="auto"
        Key columns of X; the others are the samples before, one per output.

    Attributes
    ----------
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Names of the columns, if X has names.

    Examples
    --------
    >>> from skidyn.forecasting import PersistenceRegressor, forecast_table
    >>> table = forecast_table([1.0, 2.0, 3.0])
    >>> PersistenceRegressor(trajectory=0).fit(table.X, table.y).predict(table.X).tolist()
    [[1.0], [2.0]]
    """

    def __init__(self, *, trajectory: ColumnSpec = "auto", time: ColumnSpec = "auto") -> None:
        self.trajectory = trajectory
        self.time = time

    def fit(self, X: Any, y: Any) -> PersistenceRegressor:
        """Check the columns.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            Samples before, with key columns.
        y : array-like of shape (n_samples,) or (n_samples, n_outputs)
            Samples.

        Returns
        -------
        self : object
            The forecaster.
        """
        self._check(X, y)
        self.is_fitted_ = True
        return self

    def predict(self, X: Any) -> Array:
        """Return the previous samples.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            As in fit.

        Returns
        -------
        y : ndarray of shape (n_samples,) or (n_samples, n_outputs)
            Forecast samples.
        """
        check_is_fitted(self)
        X = validate_data(self, X, reset=False, dtype=np.float64)
        return self._shaped(self._past(X).copy())


class AutoregressiveRegressor(_Forecaster):
    """Linear forecast from the last samples of the same signal, AR(k).

    Parameters
    ----------
    order : int, default=10
        Samples of the past. In shorter segments the first sample is repeated.
    ridge : float, default=1e-8
        Ridge, as a share of the number of rows times the variance of the signal.
    trajectory, time : int, str or None, default="auto"
        Key columns of X; the others are the samples before, one per output.

    Attributes
    ----------
    coef_ : ndarray of shape (n_outputs, order)
        Weights of the past, latest first.
    intercept_ : ndarray of shape (n_outputs,)
        Constants.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Names of the columns, if X has names.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.forecasting import AutoregressiveRegressor, forecast_table
    >>> table = forecast_table(np.sin(0.3 * np.arange(300)))
    >>> model = AutoregressiveRegressor(2, trajectory=0).fit(table.X, table.y)
    >>> model.coef_.round(3).tolist()  # 2 cos(0.3), -1
    [[1.911, -1.0]]
    """

    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {
        "order": [Interval(Integral, 1, None, closed="left")],
        "ridge": [Interval(Real, 0, None, closed="left")],
        "trajectory": [str, Integral, None],
        "time": [str, Integral, None],
    }

    def __init__(
        self,
        order: int = 10,
        *,
        ridge: float = 1e-8,
        trajectory: ColumnSpec = "auto",
        time: ColumnSpec = "auto",
    ) -> None:
        self.order = order
        self.ridge = ridge
        self.trajectory = trajectory
        self.time = time

    @fit_context(prefer_skip_nested_validation=True)
    def fit(self, X: Any, y: Any) -> AutoregressiveRegressor:
        """Fit one linear model per output.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            Samples before, with key columns.
        y : array-like of shape (n_samples,) or (n_samples, n_outputs)
            Samples.

        Returns
        -------
        self : object
            The forecaster.
        """
        X, targets = self._check(X, y)
        keys = fitted_keys(self)
        time = None if keys.time is None else X[:, keys.time]
        refuse_shuffled(type(self).__name__, keys.trajectories(X), time)
        lags = self._lags(X)
        fits = []
        for j in range(targets.shape[1]):
            strength = self.ridge * len(X) * max(float(lags[:, j].var()), np.finfo(float).tiny)
            fits.append(Ridge(alpha=strength).fit(lags[:, j], targets[:, j]))
        self.coef_ = np.stack([fit.coef_ for fit in fits])
        self.intercept_ = np.array([fit.intercept_ for fit in fits])
        return self

    def _lags(self, X: Array) -> Array:
        """Last `order` samples of every row, latest first: (n_samples, n_outputs, order)."""
        past = self._past(X)
        first = np.zeros(len(X), dtype=int)
        for segment in fitted_keys(self).segments(X):
            first[segment] = segment.start
        rows = np.arange(len(X))
        return np.stack([past[np.maximum(rows - k, first)] for k in range(self.order)], axis=2)

    def predict(self, X: Any) -> Array:
        """Forecast every sample from those before it in its segment.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            As in fit.

        Returns
        -------
        y : ndarray of shape (n_samples,) or (n_samples, n_outputs)
            Forecast samples.
        """
        check_is_fitted(self)
        X = validate_data(self, X, reset=False, dtype=np.float64)
        order = time_order(X, fitted_keys(self))
        lags = self._lags(taken(X, order))
        forecast = np.einsum("njk,jk->nj", lags, self.coef_) + self.intercept_
        return self._shaped(forecast if order is None else forecast[np.argsort(order)])
