# SPDX-License-Identifier: BSD-3-Clause
"""Cross-validators that read the trajectory or the time from a column of X."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.model_selection import BaseCrossValidator, GroupKFold

from skidyn._columns import _key_column, column_names

Rows = NDArray[np.intp]


def column_of(X: Any, column: int | str, what: str) -> NDArray[Any]:
    """Values of one column of a table or array, by name or position."""
    names = column_names(X)
    n_features = X.shape[1] if np.ndim(X) == 2 or names is not None else 0
    position = _key_column(what, column, names, n_features)
    if position is None:
        raise ValueError(f"X has no column {column!r}; name the {what} column or its position.")
    if hasattr(X, "iloc"):
        return np.asarray(X.iloc[:, position])
    if names is not None:  # polars
        return np.asarray(X[:, position])
    return np.asarray(X)[:, position]


class TrajectoryKFold(BaseCrossValidator):
    """K folds by trajectory: no trajectory is in training and test rows at once.

    The trajectory is read from a column of X, so the folds are correct inside ``GridSearchCV``,
    stacking and nested cross-validation, to which ``groups`` is not passed. The folds are those of
    :class:`sklearn.model_selection.GroupKFold` with these groups.

    Parameters
    ----------
    n_splits : int, default=5
        Number of folds, at most the number of trajectories.
    trajectory : int or str, default="trajectory"
        Column with the trajectory number, by name or by position.

    See Also
    --------
    PhaseKFold : For one recording of a periodic motion.
    LeakageGuard : Warns about folds that share a trajectory or a motion.

    Examples
    --------
    >>> import numpy as np
    >>> X = np.array([[0, 0.1], [0, 0.2], [1, 0.3], [1, 0.4]])
    >>> for train, test in TrajectoryKFold(2, trajectory=0).split(X):
    ...     print(train, test)
    [0 1] [2 3]
    [2 3] [0 1]
    """

    def __init__(self, n_splits: int = 5, trajectory: int | str = "trajectory") -> None:
        self.n_splits = n_splits
        self.trajectory = trajectory

    def get_n_splits(self, X: Any = None, y: Any = None, groups: Any = None) -> int:
        """Return the number of folds.

        Parameters
        ----------
        X, y, groups : object, default=None
            Ignored.

        Returns
        -------
        n_splits : int
            Number of folds.
        """
        return self.n_splits

    def split(self, X: Any, y: Any = None, groups: Any = None) -> Iterator[tuple[Rows, Rows]]:
        """Yield training and test rows of every fold.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            Holds the trajectory column.
        y : array-like, default=None
            Ignored.
        groups : array-like of shape (n_samples,), default=None
            Used in place of the trajectory column when given.

        Yields
        ------
        train, test : ndarray of int
            Row numbers.
        """
        if groups is None:
            groups = column_of(X, self.trajectory, "trajectory")
        n_trajectories = len(np.unique(groups))
        if n_trajectories == 1:
            raise ValueError(
                "X has a single trajectory, which cannot be held out. Number the recordings in the "
                "column of trajectories, record more, or use PhaseKFold for one periodic recording "
                "or TimeSeriesSplit of scikit-learn for another one."
            )
        if n_trajectories < self.n_splits:
            raise ValueError(
                f"n_splits={self.n_splits} folds need as many trajectories; X has "
                f"{n_trajectories}. Lower n_splits, or use PhaseKFold for one periodic recording."
            )
        yield from GroupKFold(self.n_splits).split(np.zeros((len(groups), 1)), y, groups)


class PhaseKFold(BaseCrossValidator):
    """K folds by the phase of a periodic motion, with a guard around every test block.

    In a recording of several periods of one motion, a block of rows such as the last fifth repeats
    motion of the training rows. Here a fold is a part of the path, in all its repetitions.

    Parameters
    ----------
    n_splits : int, default=4
        Number of parts of the period.
    period : float, s, default=None
        Length of one period; None takes the whole recording as one period.
    guard : float, s, default=0.1
        Training rows closer than this to a test block are left out of training.
    time : int or str, default="time"
        Column with the time in s, by name or by position.

    Examples
    --------
    >>> import numpy as np
    >>> X = np.c_[np.arange(8.0), np.zeros(8)]
    >>> train, test = next(PhaseKFold(2, period=4.0, guard=0.0, time=0).split(X))
    >>> test
    array([0, 1, 4, 5])
    """

    def __init__(
        self,
        n_splits: int = 4,
        *,
        period: float | None = None,
        guard: float = 0.1,
        time: int | str = "time",
    ) -> None:
        self.n_splits = n_splits
        self.period = period
        self.guard = guard
        self.time = time

    def get_n_splits(self, X: Any = None, y: Any = None, groups: Any = None) -> int:
        """Return the number of folds.

        Parameters
        ----------
        X, y, groups : object, default=None
            Ignored.

        Returns
        -------
        n_splits : int
            Number of folds.
        """
        return self.n_splits

    def split(self, X: Any, y: Any = None, groups: Any = None) -> Iterator[tuple[Rows, Rows]]:
        """Yield training and test rows of every fold.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            Holds the time column.
        y, groups : array-like, default=None
            Ignored.

        Yields
        ------
        train, test : ndarray of int
            Row numbers.

        Raises
        ------
        ValueError
            Fewer than 2 folds, a period that is not positive, or a fold without rows.
        """
        if self.n_splits < 2:
            raise ValueError(
                f"n_splits={self.n_splits}; at least 2 parts of the period are needed."
            )
        time = np.asarray(column_of(X, self.time, "time"), dtype=float)
        start = time.min()
        period = (np.nextafter(time.max(), np.inf) - start) if self.period is None else self.period
        if not period > 0:
            raise ValueError(f"period={period:g} s; a time above 0 is expected.")
        phase = np.mod(time - start, period)
        width = period / self.n_splits
        part = np.minimum((phase / width).astype(int), self.n_splits - 1)
        for k in range(self.n_splits):
            test = part == k
            # distance along the circle from the nearer edge of the test block
            before = np.mod(k * width - phase, period)
            after = np.mod(phase - (k + 1) * width, period)
            train = ~test & (np.minimum(before, after) >= self.guard)
            if not (train.any() and test.any()):
                lacking = "test" if train.any() else "training"
                raise ValueError(
                    f"fold {k + 1} of {self.n_splits} has no {lacking} rows: the log lasts "
                    f"{np.ptp(time):.4g} s, with period={period:.4g} s and guard={self.guard:g} s. "
                    "Check that all are in s, or use fewer folds or a shorter guard."
                )
            yield np.flatnonzero(train), np.flatnonzero(test)


def held_out_folds(trajectory: NDArray[Any], n_splits: int, *, guard: int = 0) -> list[Any]:
    """Folds for cross-fitting inside an estimator: by trajectory, or by blocks of a single one.

    With fewer trajectories than folds each trajectory is one fold; a single trajectory is cut into
    ``n_splits`` contiguous blocks and ``guard`` rows around a test block are left out of training.
    """
    n_trajectories, n_rows = len(np.unique(trajectory)), len(trajectory)
    if n_trajectories > 1:
        folds = GroupKFold(min(n_splits, n_trajectories))
        return list(folds.split(np.zeros((n_rows, 1)), groups=trajectory))
    rows = np.arange(n_rows)
    result = []
    for test in np.array_split(rows, min(n_splits, n_rows)):
        far = (rows < test[0] - guard) | (rows > test[-1] + guard)
        if far.any():
            result.append((np.flatnonzero(far), test))
    return result
