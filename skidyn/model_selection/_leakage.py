# SPDX-License-Identifier: BSD-3-Clause
"""A guard against folds that share a trajectory or a motion."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from sklearn.base import clone
from sklearn.model_selection import BaseCrossValidator, check_cv, cross_val_score
from sklearn.utils import Bunch

from skidyn._columns import ColumnSpec
from skidyn._keys import Keys, keys_of
from skidyn.model_selection._split import TrajectoryKFold

Rows = NDArray[np.intp]

#: Two samples this close in every feature, in standard deviations, count as the same motion.
SAME_MOTION = 0.02
#: A fold in which a larger share of test rows repeats motion of training rows is reported.
REPEATED_SHARE = 0.1
#: Number of test rows checked per fold.
LOOKED_AT = 2000


class LeakageWarning(UserWarning):
    """Training and test rows of a fold are not independent; the score is optimistic.

    Examples
    --------
    >>> import warnings
    >>> warnings.simplefilter("error", LeakageWarning)  # make leaking folds an error
    >>> warnings.simplefilter("default", LeakageWarning)
    """


class LeakageGuard(BaseCrossValidator):
    """Cross-validator that warns when the folds of another one leak.

    Two kinds of leaks are detected: a trajectory in both training and test rows, whose neighbouring
    samples are nearly identical; and a motion in both, that is, test rows whose features are closer
    than 0.02 standard deviations to a training row, as when a recording repeats one period.

    Parameters
    ----------
    cv : cross-validator, int or iterable, default=5
        Guarded cross-validator; its folds are passed on unchanged.
    trajectory, time : int, str or None, default="auto"
        Key columns; they are not part of the motion.

    See Also
    --------
    leakage_report : Shows what leaking folds would have claimed.

    Examples
    --------
    >>> import numpy as np, warnings
    >>> from sklearn.model_selection import KFold
    >>> X = np.c_[np.repeat([0, 1], 50), np.random.default_rng(0).normal(size=(100, 3))]
    >>> guard = LeakageGuard(KFold(5, shuffle=True, random_state=0), trajectory=0)
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     folds = list(guard.split(X))
    >>> caught[0].category.__name__
    'LeakageWarning'
    """

    def __init__(
        self, cv: Any = 5, *, trajectory: ColumnSpec = "auto", time: ColumnSpec = "auto"
    ) -> None:
        self.cv = cv
        self.trajectory = trajectory
        self.time = time

    def get_n_splits(self, X: Any = None, y: Any = None, groups: Any = None) -> int:
        """Return the number of folds of the guarded cross-validator.

        Parameters
        ----------
        X, y, groups : object, default=None
            Passed on.

        Returns
        -------
        n_splits : int
            Number of folds.
        """
        return int(check_cv(self.cv).get_n_splits(X, y, groups))

    def split(self, X: Any, y: Any = None, groups: Any = None) -> Iterator[tuple[Rows, Rows]]:
        """Yield the guarded folds; warn once if they leak.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            Samples with key columns.
        y, groups : array-like, default=None
            Passed on.

        Yields
        ------
        train, test : ndarray of int
            Row numbers.
        """
        folds = list(check_cv(self.cv).split(X, y, groups))
        keys = keys_of(X, trajectory=self.trajectory, time=self.time)
        found = find_leaks(np.asarray(X, dtype=float), keys, folds)
        message = _message(found)
        if message:
            warnings.warn(message, LeakageWarning, stacklevel=2)
        yield from folds


def find_leaks(X: NDArray[Any], keys: Keys, folds: list[Any]) -> Bunch:
    """Trajectories that folds share, and the share of test rows with motion of training rows."""
    trajectory = keys.trajectories(X)
    features = X[:, list(keys.features)]
    spread = features.std(axis=0)
    features = features[:, spread > 0] / spread[spread > 0]
    shared: set[Any] = set()
    repeated = []
    for train, test in folds:
        # a single recording is always shared; the question is whether its motion is
        if len(np.unique(trajectory)) > 1:
            shared |= set(np.intersect1d(trajectory[train], trajectory[test]).tolist())
        looked_at = test[:: max(1, len(test) // LOOKED_AT)]
        distance, _ = cKDTree(features[train]).query(features[looked_at], p=np.inf)
        repeated.append(float((distance < SAME_MOTION).mean()))
    return Bunch(shared_trajectories=sorted(shared), repeated_share=max(repeated, default=0.0))


def _message(found: Bunch) -> str:
    parts = []
    if found.shared_trajectories:
        first = ", ".join(f"{label:g}" for label in found.shared_trajectories[:5])
        parts.append(
            f"{len(found.shared_trajectories)} trajectories (such as {first}) are in training and "
            "test rows of the same fold; use TrajectoryKFold"
        )
    if found.repeated_share > REPEATED_SHARE:
        parts.append(
            f"{found.repeated_share:.0%} of the test rows of a fold repeat a motion in its "
            "training rows; hold out whole motions (TrajectoryKFold, PhaseKFold)"
        )
    return "The folds leak: " + "; ".join(parts) + "." if parts else ""


def leakage_report(
    estimator: Any,
    X: Any,
    y: Any,
    *,
    cv: Any = 5,
    honest_cv: Any = None,
    trajectory: ColumnSpec = "auto",
    time: ColumnSpec = "auto",
    scoring: Any = None,
) -> Bunch:
    """Compare the scores of an estimator with leaking and with correct folds.

    Parameters
    ----------
    estimator : estimator
        A scikit-learn regressor; cloned.
    X : DataFrame or array-like of shape (n_samples, n_features)
        Samples with key columns.
    y : array-like of shape (n_samples,) or (n_samples, n_joints), N m (N for prismatic joints)
        Torque.
    cv : cross-validator or int, default=5
        The folds to be checked.
    honest_cv : cross-validator, default=None
        Correct folds for comparison; :class:`TrajectoryKFold` with at most 5 folds if None.
    trajectory, time : int, str or None, default="auto"
        Key columns.
    scoring : str or callable, default=None
        The estimator's own score if None.

    Returns
    -------
    report : Bunch
        ``claimed`` and ``honest`` (scores of the folds), ``shared_trajectories``,
        ``repeated_share`` (of the worst fold) and ``message`` (empty without a leak).

    Examples
    --------
    >>> import numpy as np
    >>> from sklearn.model_selection import KFold
    >>> from sklearn.neighbors import KNeighborsRegressor
    >>> rng = np.random.default_rng(0)
    >>> trajectory = np.repeat(np.arange(5), 40)
    >>> walk = rng.normal(size=(5, 40, 2)).cumsum(axis=1).reshape(-1, 2)
    >>> y = rng.normal(size=5)[trajectory]  # nothing but a level of each trajectory
    >>> report = leakage_report(KNeighborsRegressor(3), np.c_[trajectory, walk], y,
    ...                         cv=KFold(5, shuffle=True, random_state=0), trajectory=0)
    >>> bool(report.claimed.mean() > 0.5 > report.honest.mean())
    True
    """
    keys = keys_of(X, trajectory=trajectory, time=time)
    table = np.asarray(X, dtype=float)
    if honest_cv is None:
        if keys.trajectory is None:
            raise ValueError("X has no trajectory column; declare it, or give honest_cv.")
        n_splits = min(5, len(np.unique(table[:, keys.trajectory])))
        honest_cv = TrajectoryKFold(n_splits, trajectory=keys.trajectory)
    folds = list(check_cv(cv).split(X, y))
    found = find_leaks(table, keys, folds)
    claimed, honest = (
        cross_val_score(clone(estimator), X, y, cv=each, scoring=scoring)
        for each in (folds, honest_cv)
    )
    return Bunch(claimed=claimed, honest=honest, message=_message(found), **found)
