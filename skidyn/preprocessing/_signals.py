# SPDX-License-Identifier: BSD-3-Clause
"""Transformers of signals; key columns are unchanged, and segments are processed separately."""

from __future__ import annotations

from numbers import Integral, Real
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import signal
from sklearn.utils.validation import check_is_fitted

from skidyn._columns import ColumnSpec, _key_column
from skidyn._compat import Interval
from skidyn._exceptions import ColumnError
from skidyn._keys import Keys, fitted_keys
from skidyn._order import refuse_shuffled
from skidyn._transformer import LogTransformer
from skidyn.preprocessing._affine import scaling_of

Array = NDArray[np.float64]


#: Share by which a stated rate may differ from that of the time column.
OTHER_RATE = 0.1


class SignalTransformer(LogTransformer):
    """Base of transformers of signals with key columns and segments."""

    trajectory: ColumnSpec
    time: ColumnSpec
    #: Whether the resulting table is a log: signals in their units, and key columns.
    gives_signals: ClassVar[bool] = True

    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {
        "trajectory": [str, Integral, None],
        "time": [str, Integral, None],
    }

    def _segments(self, X: Array) -> list[slice]:
        """Slices of consecutive rows."""
        keys = fitted_keys(self)
        time = None if keys.time is None else X[:, keys.time]
        refuse_shuffled(type(self).__name__, keys.trajectories(X), time)
        return keys.segments(X)


def _sampling_rate(X: Array, keys: Keys, segments: list[slice], rate: float | None) -> float:
    """Samples per second: from the median step of the time column, or as given without one."""
    if keys.time is None:
        if rate is None:
            raise ValueError("X has no time column; declare it, or give rate in Hz.")
        return float(rate)
    steps = np.concatenate([np.diff(X[segment, keys.time]) for segment in segments])
    steps = steps[steps > 0]
    if len(steps) == 0:
        if rate is not None:
            return float(rate)
        raise ValueError(
            "the time column never advances, so that it has no rate. Rates need two samples of a "
            f"trajectory at least (n_samples = {len(X)} here), and times in float64: seconds "
            "since 1970 are equal in float32."
        )
    found = float(1.0 / np.median(steps))
    if rate is not None and abs(rate / found - 1) > OTHER_RATE:
        raise ValueError(
            f"rate={rate:g} Hz, but by the time column of X it is {found:.4g} Hz; omit rate, or "
            "give time=None if the column is no clock in s."
        )
    return found


def _rate_of_log(
    X: Array, keys: Keys, segments: list[slice], rate: float | None, trained: float
) -> float:
    """Samples per second of a new log, or that in training if its rows are too few to tell."""
    if keys.time is None or all(segment.stop - segment.start < 2 for segment in segments):
        return trained
    return _sampling_rate(X, keys, segments, rate)


def segment_times(X: Array, keys: Keys, rows: slice, rate: float) -> Array:
    """Times in s within a segment; raises an error if they do not increase."""
    if keys.time is None:
        return np.arange(rows.stop - rows.start) / rate
    times: Array = X[rows, keys.time]
    still = np.flatnonzero(np.diff(times) <= 0)
    if len(still):
        raise ValueError(
            f"time does not advance at row {rows.start + still[0] + 1}; remove repeated rows first."
        )
    return times


def refuse_cutoff(cutoff: float, rate: float) -> None:
    """Raise an error for a cut-off that is too high for the sampling rate."""
    if not cutoff < rate / 2:
        raise ValueError(
            f"cutoff={cutoff} Hz is not below half the sampling rate ({rate / 2:.4g} Hz)."
        )


def _low_pass(values: Array, cutoff: float, order: int, rate: float) -> Array:
    """Zero-phase Butterworth low-pass of the columns of one segment."""
    refuse_cutoff(cutoff, rate)
    sections = signal.butter(order, cutoff, fs=rate, output="sos")
    longest = 3 * (2 * len(sections) + 1)
    padding = min(longest, len(values) - 1)
    filtered: Array = signal.sosfiltfilt(sections, values, axis=0, padlen=padding)
    return filtered


class ButterworthFilter(SignalTransformer):
    """Zero-phase Butterworth low-pass of all signals, within each segment.

    Parameters
    ----------
    cutoff : float, Hz, default=10.0
        Frequency at which one pass transmits half of the power; the filter runs forward and
        backward, which doubles its attenuation.
    order : int, default=4
        Order of one pass.
    rate : float, Hz, default=None
        Sampling rate if X has no time column, from which it is found otherwise, in every log.
    trajectory, time : int, str or None, default="auto"
        Key columns, passed on unchanged.

    Attributes
    ----------
    rate_ : float, Hz
        Sampling rate of the training log.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Names of the columns, if X has names.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.preprocessing import ButterworthFilter
    >>> t = np.arange(500) * 0.002
    >>> X = np.c_[t, np.sin(t) + 0.1 * np.sin(2 * np.pi * 100 * t)]
    >>> smooth = ButterworthFilter(10.0, time=0).fit_transform(X)
    >>> bool(np.abs(smooth[50:-50, 1] - np.sin(t)[50:-50]).max() < 0.01)
    True
    """

    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {
        **SignalTransformer._parameter_constraints,
        "cutoff": [Interval(Real, 0, None, closed="neither")],
        "order": [Interval(Integral, 1, None, closed="left")],
        "rate": [Interval(Real, 0, None, closed="neither"), None],
    }

    def __init__(
        self,
        cutoff: float = 10.0,
        *,
        order: int = 4,
        rate: float | None = None,
        trajectory: ColumnSpec = "auto",
        time: ColumnSpec = "auto",
    ) -> None:
        self.cutoff = cutoff
        self.order = order
        self.rate = rate
        self.trajectory = trajectory
        self.time = time

    def _learn(self, X: Array) -> None:
        self.rate_ = _sampling_rate(X, fitted_keys(self), self._segments(X), self.rate)

    def _changed(self, X: Array) -> Array:
        keys, segments = fitted_keys(self), self._segments(X)
        filtered: Array = X.copy()
        features = list(keys.features)
        rate = _rate_of_log(X, keys, segments, self.rate, self.rate_)
        for segment in segments:
            filtered[segment, features] = _low_pass(
                X[segment, features], self.cutoff, self.order, rate
            )
        return filtered


class TimeDerivative(SignalTransformer):
    """Append time derivatives by central differences, within each segment.

    The result is X, then the derivatives in units per second, with a ``d`` before their names.

    Parameters
    ----------
    columns : sequence of int or str, default=None
        Columns to differentiate; None means the velocities: columns whose names begin with ``dq``,
        or without names the second half of the features (positions, then velocities).
    cutoff : float, Hz, default=None
        Low-pass the columns first (zero-phase Butterworth of order 4); only the derivatives use the
        smoothed signals. State the cut-off with every result, since it has a large influence on
        residuals.
    rate : float, Hz, default=None
        Sampling rate if X has no time column.
    trajectory, time : int, str or None, default="auto"
        Key columns, passed on unchanged.

    Attributes
    ----------
    columns_ : ndarray of int
        Positions of the columns that are differentiated.
    rate_ : float, Hz
        Sampling rate of the training log.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Names of the columns, if X has names.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.preprocessing import TimeDerivative
    >>> t = np.arange(200) * 0.01
    >>> X = np.c_[t, np.sin(t), np.cos(t)]  # time, position, velocity
    >>> table = TimeDerivative(time=0).fit_transform(X)
    >>> bool(np.abs(table[1:-1, 3] + np.sin(t)[1:-1]).max() < 1e-4)
    True
    """

    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {
        **SignalTransformer._parameter_constraints,
        "columns": ["array-like", None],
        "cutoff": [Interval(Real, 0, None, closed="neither"), None],
        "rate": [Interval(Real, 0, None, closed="neither"), None],
    }

    def __init__(
        self,
        columns: Any = None,
        *,
        cutoff: float | None = None,
        rate: float | None = None,
        trajectory: ColumnSpec = "auto",
        time: ColumnSpec = "auto",
    ) -> None:
        self.columns = columns
        self.cutoff = cutoff
        self.rate = rate
        self.trajectory = trajectory
        self.time = time

    def _learn(self, X: Array) -> None:
        keys, names = fitted_keys(self), self._names()
        velocities = [i for i, name in enumerate(names or []) if name.startswith("dq")]
        if self.columns is not None:
            found = [_key_column("columns", c, names, X.shape[1]) for c in self.columns]
        elif velocities:
            found = [*velocities]
        else:
            found = [*keys.features[len(keys.features) // 2 :]]
        self.columns_ = np.array(found, dtype=int)
        refuse_columns_there(names, self.columns_, 1)
        self.rate_ = _sampling_rate(X, keys, self._segments(X), self.rate)

    def _changed(self, X: Array) -> Array:
        keys, segments = fitted_keys(self), self._segments(X)
        derivative = np.empty((len(X), len(self.columns_)))
        rate = _rate_of_log(X, keys, segments, self.rate, self.rate_)
        for segment in segments:
            values = X[segment, self.columns_]
            if len(values) < 2:
                raise ValueError(
                    f"the segment at row {segment.start} has 1 sample; a derivative needs two. "
                    "Remove it, or fix the trajectory and time columns."
                )
            if self.cutoff is not None:
                values = _low_pass(values, self.cutoff, 4, rate)
            times = segment_times(X, keys, segment, rate)
            derivative[segment] = np.gradient(
                values, times, axis=0, edge_order=2 if len(values) > 2 else 1
            )
        extended: Array = np.c_[X, derivative]
        return extended

    def _renamed(self, names: NDArray[Any]) -> list[str]:
        return [*names, *(f"d{names[i]}" for i in self.columns_)]


class SignalScaler(SignalTransformer):
    """Scale signals to the range 0 to 1 or to unit variance, without a change of key columns.

    Parameters
    ----------
    kind : {"minmax", "standard"}, default="minmax"
        Range 0 to 1 (eq. 8 of [1]_), or zero mean and unit variance.
    trajectory, time : int, str or None, default="auto"
        Key columns, passed on unchanged.

    Attributes
    ----------
    offset_, scale_ : ndarray of shape (n_features,)
        ``(X - offset_) / scale_``; 0 and 1 for key columns.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Names of the columns, if X has names.

    References
    ----------
    .. [1] "Semiparametric Deep Learning Manipulator Inverse Dynamics Modeling Method for Smart
       City and Industrial Applications", eq. 8.

    Examples
    --------
    >>> from skidyn.preprocessing import SignalScaler
    >>> SignalScaler(trajectory=0).fit_transform([[7, 1.0], [8, 3.0]])
    array([[7., 0.],
           [8., 1.]])
    """

    gives_signals = False
    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {
        **SignalTransformer._parameter_constraints,
        "kind": [str],
    }

    def __init__(
        self,
        kind: str = "minmax",
        *,
        trajectory: ColumnSpec = "auto",
        time: ColumnSpec = "auto",
    ) -> None:
        self.kind = kind
        self.trajectory = trajectory
        self.time = time

    def _learn(self, X: Array) -> None:
        if self.kind not in ("minmax", "standard"):
            raise ValueError(f"kind={self.kind!r}; use 'minmax' or 'standard'.")
        features = list(fitted_keys(self).features)
        self.offset_, self.scale_ = np.zeros(X.shape[1]), np.ones(X.shape[1])
        self.offset_[features], self.scale_[features] = scaling_of(X[:, features], self.kind)

    def _changed(self, X: Array) -> Array:
        scaled: Array = (X - self.offset_) / self.scale_
        return scaled

    def inverse_transform(self, X: Any) -> Array:
        """Undo the scaling.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_features)
            Scaled log.

        Returns
        -------
        X_original : ndarray of shape (n_samples, n_features)
            Signals in their units.
        """
        check_is_fitted(self)
        return np.asarray(X, dtype=np.float64) * self.scale_ + self.offset_


def refuse_columns_there(names: list[str] | None, columns: Array, derivatives: int) -> None:
    """Refuse to append derivatives that X has already."""
    given = names or []
    made = [f"{'d' * k}{given[int(i)]}" for i in columns if names for k in (1, derivatives)]
    there = sorted({name for name in made if name in given})
    if there:
        raise ColumnError(
            f"X has {', '.join(there)} already, which would be appended again. Leave them out of "
            "X to derive them again, or omit the transformer to keep them"
        )
