# SPDX-License-Identifier: BSD-3-Clause
"""Velocities and accelerations whose smoothing is chosen from the data."""

from __future__ import annotations

from numbers import Integral, Real
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from skidyn._columns import ColumnSpec, _key_column
from skidyn._compat import Interval, StrOptions
from skidyn._keys import fitted_keys
from skidyn.preprocessing._signals import (
    SignalTransformer,
    _sampling_rate,
    refuse_columns_there,
    refuse_cutoff,
    segment_times,
)
from skidyn.preprocessing._smoothers import SMOOTHERS, Smoothed

Array = NDArray[np.float64]

#: Number of rows used for the choice, cut-offs per octave, and blocks for the standard error.
CHOICE_ROWS, PER_OCTAVE, BLOCKS = 4_000, 2, 16
#: Cut-offs tried, in Hz and as a share of the sampling rate.
LOWEST_CUTOFF, HIGHEST_SHARE = 0.7, 0.25


class SmoothDerivatives(SignalTransformer):
    """Smooth signals and append their derivatives; method and cut-off chosen by cross-validation.

    Every candidate predicts each sample from its neighbours without the sample itself. The lowest
    cut-off whose error is within one standard error of the least is selected, since derivatives
    amplify the remaining noise. One cut-off is used for all columns, because differently filtered
    joints are inconsistent with one motion. Segments are processed separately.

    The result is X with smoothed columns, then their first derivatives (unit/s, a ``d`` before the
    name), then the second (unit/s^2, ``dd``) where two are appended.

    Parameters
    ----------
    columns : sequence of int or str, default=None
        Columns to smooth and differentiate. None means the velocities (columns whose names begin
        with ``dq``) if there are any, otherwise the positions (``q``), or all columns of an X
        without names.
    derivatives : {1, 2}, default=None
        Number of derivatives that are appended; None means one for velocities and two otherwise.
    method : {"auto", "butterworth", "savitzky_golay", "kalman"}, default="auto"
        Zero-phase Butterworth of order 4 with central differences; local polynomials of degree 4;
        Kalman smoother of a point with white jerk, the only one that uses unequal time steps
        unchanged. ``"auto"`` selects the one with the least error, or the Kalman smoother if the
        time steps vary by more than 10 %.
    cutoff : float, Hz, default=None
        Frequency at which half of the amplitude passes; chosen if None. State it with every result.
    rate : float, Hz, default=None
        Sampling rate if X has no time column.
    trajectory, time : int, str or None, default="auto"
        Key columns, passed on unchanged.

    Attributes
    ----------
    columns_ : ndarray of int
        Positions of the columns that are smoothed.
    derivatives_ : int
        Number of derivatives that are appended.
    method_ : str
        Method that is used.
    cutoff_ : float, Hz
        Cut-off that is used.
    cv_results_ : dict of list
        ``method``, ``cutoff`` (Hz), ``error`` (mean square of the left-out error, geometric mean
        over columns) and its ``standard_error``; empty if nothing was chosen.
    rate_ : float, Hz
        Sampling rate of the training log.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Names of the columns, if X has names.

    References
    ----------
    .. [1] P. Craven, G. Wahba, "Smoothing Noisy Data with Spline Functions", Numerische Mathematik
       31, 1979 (leave-one-out error of a linear smoother).
    .. [2] R. W. Schafer, "What Is a Savitzky-Golay Filter?", IEEE Signal Processing Magazine 28(4),
       2011.
    .. [3] L. Breiman et al., "Classification and Regression Trees", 1984, section 3.4.3 (the rule
       of one standard error).

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.preprocessing import SmoothDerivatives
    >>> t = np.arange(1000) * 0.005
    >>> noise = 1e-4 * np.random.default_rng(0).normal(size=t.size)
    >>> smooth = SmoothDerivatives(time=0).fit(np.c_[t, np.sin(3 * t) + noise])
    >>> table = smooth.transform(np.c_[t, np.sin(3 * t) + noise])  # time, q, dq, ddq
    >>> bool(np.abs(table[50:-50, 3] + 9 * np.sin(3 * t)[50:-50]).max() < 0.1)
    True
    """

    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {
        **SignalTransformer._parameter_constraints,
        "columns": ["array-like", None],
        "derivatives": [Interval(Integral, 1, 2, closed="both"), None],
        "method": [StrOptions({"auto", *SMOOTHERS})],
        "cutoff": [Interval(Real, 0, None, closed="neither"), None],
        "rate": [Interval(Real, 0, None, closed="neither"), None],
    }

    def __init__(
        self,
        columns: Any = None,
        *,
        derivatives: int | None = None,
        method: str = "auto",
        cutoff: float | None = None,
        rate: float | None = None,
        trajectory: ColumnSpec = "auto",
        time: ColumnSpec = "auto",
    ) -> None:
        self.columns = columns
        self.derivatives = derivatives
        self.method = method
        self.cutoff = cutoff
        self.rate = rate
        self.trajectory = trajectory
        self.time = time

    def _learn(self, X: Array) -> None:
        keys, names = fitted_keys(self), self._names()
        velocities = [i for i, name in enumerate(names or []) if name.startswith("dq")]
        positions = [i for i, name in enumerate(names or []) if name.startswith("q")]
        if self.columns is not None:
            chosen = [_key_column("columns", c, names, X.shape[1]) for c in self.columns]
            found = [column for column in chosen if column is not None]
        else:
            found = velocities or positions or [*keys.features]
        self.columns_ = np.array(found, dtype=int)
        of_velocities = self.columns is None and bool(velocities)
        self.derivatives_ = self.derivatives or (1 if of_velocities else 2)
        refuse_columns_there(names, self.columns_, self.derivatives_)
        self.rate_ = _sampling_rate(X, keys, self._segments(X), self.rate)
        if self.cutoff is not None:
            refuse_cutoff(self.cutoff, self.rate_)
        self._choose(X)

    def _choose(self, X: Array) -> None:
        """Method and cut-off of least left-out error, by the rule of one standard error."""
        parts = self._parts_to_judge(X)
        uneven = any(np.ptp(np.diff(times)) > 0.2 / self.rate_ for times, _ in parts)
        methods = [self.method] if self.method != "auto" else sorted(SMOOTHERS)
        if self.method == "auto" and uneven:
            methods = ["kalman"]
        cutoffs = _candidates(self.rate_) if self.cutoff is None else np.array([self.cutoff])
        self.cv_results_: dict[str, list[Any]] = {}
        if not parts or (len(methods) == 1 and len(cutoffs) == 1):
            self.method_, self.cutoff_ = methods[0], float(cutoffs[len(cutoffs) // 2])
            return
        errors = np.array(
            [[_left_out_error(parts, name, float(c)) for c in cutoffs] for name in methods]
        )  # (methods, cut-offs, blocks)
        mean = errors.mean(axis=-1)
        best, at = divmod(int(np.argmin(mean)), len(cutoffs))
        difference = errors[best] - errors[best, at]
        doubt = difference.std(axis=-1, ddof=1) / np.sqrt(errors.shape[-1])
        chosen = int(np.flatnonzero(difference.mean(axis=-1) <= doubt)[0])
        self.method_, self.cutoff_ = methods[best], float(cutoffs[min(chosen, at)])
        spread = errors.std(axis=-1, ddof=1) / np.sqrt(errors.shape[-1])
        self.cv_results_ = {
            "method": np.repeat(methods, len(cutoffs)).tolist(),
            "cutoff": np.tile(cutoffs, len(methods)).tolist(),
            "error": mean.ravel().tolist(),
            "standard_error": spread.ravel().tolist(),
        }

    def _parts_to_judge(self, X: Array) -> list[tuple[Array, Array]]:
        """Times and values of the longest segments, few enough rows for a quick choice."""
        keys = fitted_keys(self)
        parts: list[tuple[Array, Array]] = []
        for segment in sorted(keys.segments(X), key=lambda s: int(s.start - s.stop)):
            room = CHOICE_ROWS - sum(len(times) for times, _ in parts)
            if segment.stop - segment.start < 10 * BLOCKS or room < 10 * BLOCKS:
                break
            rows = slice(segment.start, min(segment.stop, segment.start + room))
            parts.append((self._times(X, rows), X[rows][:, self.columns_]))
        return parts

    def _times(self, X: Array, rows: slice) -> Array:
        return segment_times(X, fitted_keys(self), rows, self.rate_)

    def _changed(self, X: Array) -> Array:
        smoothed = X.copy()
        first = np.empty((len(X), len(self.columns_)))
        second = np.empty_like(first)
        for segment in self._segments(X):
            if segment.stop - segment.start < 6:
                raise ValueError(
                    f"the segment at row {segment.start} has {segment.stop - segment.start} "
                    "sample(s); smoothed derivatives need six. Remove it, or fix the trajectory "
                    "and time columns."
                )
            result = _smooth(
                self.method_, self._times(X, segment), X[segment][:, self.columns_], self.cutoff_
            )
            smoothed[segment, self.columns_] = result.value
            first[segment], second[segment] = result.first, result.second
        return np.hstack([smoothed, first, second][: 1 + self.derivatives_])

    def _renamed(self, names: NDArray[Any]) -> list[str]:
        prefixes = ("d", "dd")[: self.derivatives_]
        own = [f"{prefix}{names[i]}" for prefix in prefixes for i in self.columns_]
        return [*names, *own]


def _candidates(rate: float) -> Array:
    """Cut-offs in Hz, two per octave."""
    highest = HIGHEST_SHARE * rate
    lowest = min(LOWEST_CUTOFF, highest / 2)
    count = int(np.ceil(PER_OCTAVE * np.log2(highest / lowest))) + 1
    return np.geomspace(lowest, highest, count)


def _smooth(method: str, times: Array, values: Array, cutoff: float) -> Smoothed:
    return SMOOTHERS[method](times, values, cutoff)


def _left_out_error(parts: list[tuple[Array, Array]], method: str, cutoff: float) -> Array:
    """Mean squared left-out error per block of rows, geometric mean over columns.

    The ends of a segment are left out, so that the assumptions of a filter beyond them have no
    influence.
    """
    total, rows = np.zeros((BLOCKS, parts[0][1].shape[1])), 0
    for times, values in parts:
        error = _smooth(method, times, values, cutoff).left_out_error(values)
        ends = min(int(0.5 / (LOWEST_CUTOFF * np.median(np.diff(times)))), len(times) // 4)
        inner = error[ends : len(error) - ends]
        means = [np.mean(block**2, axis=0) for block in np.array_split(inner, BLOCKS)]
        total, rows = total + len(inner) * np.array(means), rows + len(inner)
    squares = total / rows
    # constant columns have no noise; they must not influence the choice
    scale = squares.mean(axis=0)
    moving = scale > 1e-24
    if not moving.any():
        return np.zeros(BLOCKS)
    typical = np.exp(np.mean(np.log(scale[moving])))
    return np.asarray(typical * np.mean(squares[:, moving] / scale[moving], axis=1))
