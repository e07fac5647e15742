# SPDX-License-Identifier: BSD-3-Clause
"""Whether a robot has changed since a reference recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import clone

from skidyn._exceptions import SkidynError
from skidyn.metrics._errors import _pair

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Drift:
    """Errors of one model on a reference and on a new recording.

    Parameters
    ----------
    reference, error : ndarray of shape (n_joints,), N m (N if prismatic)
        Root mean square error where the joint moves: on held-out trajectories of the reference, and
        on the new recording.

    Examples
    --------
    >>> from skidyn.metrics import Drift
    >>> drift = Drift(np.array([1.0, 2.0]), np.array([1.1, 5.0]))
    >>> drift.ratio.tolist(), drift.drifted(1.5).tolist()
    ([1.1, 2.5], [False, True])
    """

    reference: Array
    error: Array

    @property
    def ratio(self) -> Array:
        """New error over the reference's, (n_joints,); about 1 on an unchanged robot."""
        return self.error / self.reference

    def drifted(self, limit: float) -> NDArray[np.bool_]:
        """Joints whose ratio is above the limit.

        Parameters
        ----------
        limit : float
            Largest ratio that passes.

        Returns
        -------
        ndarray of shape (n_joints,) of bool
            Joints above the limit.

        Examples
        --------
        >>> Drift(np.array([1.0]), np.array([2.0])).drifted(1.5).tolist()
        [True]
        """
        return np.asarray(self.ratio > limit)


def drift(
    model: Any,
    X: Any,
    y: ArrayLike,
    X_reference: Any,
    y_reference: ArrayLike,
    *,
    moving: tuple[ArrayLike, ArrayLike] | None = None,
    folds: Sequence[tuple[Any, Any]] | None = None,
) -> Drift:
    """Compare the errors of a model on a new recording with those on a reference.

    The model is fitted to the reference; its usual error is that on trajectories left out of the
    fit. An unchanged robot that repeats its motion gives a ratio of about 1.

    Parameters
    ----------
    model : estimator
        Not fitted; it is cloned.
    X : array-like of shape (n_samples, n_features)
        New recording.
    y : array-like of shape (n_samples, n_joints), N m (N if prismatic)
        Its measured torques.
    X_reference : array-like of shape (n_reference, n_features)
        Reference recording.
    y_reference : array-like of shape (n_reference, n_joints), N m (N if prismatic)
        Its measured torques.
    moving : pair of array-like of shape (n_samples, n_joints) of bool, optional
        Samples to evaluate, of the new recording and of the reference: dry friction at rest is
        undetermined, so rest gives no information about wear. All by default.
    folds : sequence of pairs of index arrays, optional
        Splits of the reference; four folds of :class:`~skidyn.model_selection.TrajectoryKFold`
        by default.

    Returns
    -------
    Drift
        ``reference``, ``error`` and ``ratio`` of every joint.

    Raises
    ------
    SkidynError
        A joint has no evaluated sample, or the reference has fewer than four trajectories and
        there are no `folds`.

    Examples
    --------
    >>> from sklearn.linear_model import LinearRegression
    >>> rng = np.random.default_rng(0)
    >>> X = rng.normal(size=(80, 2))
    >>> y = X[:, :1] + 0.1 * rng.normal(size=(80, 1))
    >>> folds = [(np.arange(40), np.arange(40, 80)), (np.arange(40, 80), np.arange(40))]
    >>> bool(drift(LinearRegression(), X, y + 1.0, X, y, folds=folds).ratio[0] > 5)
    True
    """
    from skidyn.model_selection import TrajectoryKFold

    true, known = np.asarray(y, float), np.asarray(y_reference, float)
    if folds is None:
        try:
            folds = list(TrajectoryKFold(n_splits=4).split(X_reference, known))
        except ValueError as few:
            why = str(few).partition(".")[0]  # the remedies of the folds are no options here
            raise SkidynError(
                f"the reference cannot be cut into the four folds of whole trajectories that are "
                f"held out by default ({why}); give a reference with a column 'trajectory' that "
                "numbers four recordings at least, or give folds=, a list of pairs of training and "
                "test rows"
            ) from few
    told = np.full(known.shape, np.nan)
    for train, test in folds:
        fitted = clone(model).fit(_rows(X_reference, train), known[train])
        told[test] = fitted.predict(_rows(X_reference, test)).reshape(len(test), *known.shape[1:])
    new = clone(model).fit(X_reference, known).predict(X)
    left = [a - b for a, b in (_pair(true, new), _pair(known, told))]
    use = moving or tuple(np.ones(r.shape, bool) for r in left)
    error, reference = (_rms(r, np.asarray(u, bool)) for r, u in zip(left, use, strict=True))
    return Drift(reference, error)


def _rows(X: Any, rows: NDArray[np.intp]) -> Any:
    return X.iloc[rows] if hasattr(X, "iloc") else np.asarray(X)[rows]


def _rms(left: Array, use: NDArray[np.bool_]) -> Array:
    use = use & np.isfinite(left)
    if not use.any(axis=0).all():
        j = int(np.flatnonzero(~use.any(axis=0))[0])
        raise SkidynError(
            f"joint {j + 1} never moves in one of the recordings, so its error gives no "
            "information about wear; give recordings in which every joint moves"
        )
    square = np.where(use, left**2, 0.0).sum(axis=0) / use.sum(axis=0)
    return np.asarray(np.sqrt(square))
