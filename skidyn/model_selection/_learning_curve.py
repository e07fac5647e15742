# SPDX-License-Identifier: BSD-3-Clause
"""Error against the amount of data, counted in trajectories."""

from __future__ import annotations

from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import ArrayLike
from sklearn.base import clone
from sklearn.metrics import check_scoring
from sklearn.utils import Bunch, _safe_indexing, check_random_state

from skidyn.model_selection._split import TrajectoryKFold, column_of


def trajectory_learning_curve(
    estimator: Any,
    X: Any,
    y: Any,
    *,
    n_trajectories: ArrayLike | None = None,
    cv: Any = 5,
    trajectory: int | str = "trajectory",
    scoring: Any = None,
    n_jobs: int | None = None,
    random_state: Any = None,
) -> Bunch:
    """Score on held-out trajectories against the number of training trajectories.

    Parameters
    ----------
    estimator : estimator
        A scikit-learn regressor; cloned for every fit.
    X : DataFrame or array-like of shape (n_samples, n_features)
        Samples with a trajectory column.
    y : array-like of shape (n_samples,) or (n_samples, n_joints), N m (N for prismatic joints)
        Torque.
    n_trajectories : array-like of int, default=None
        Sizes of the training set; 1, 2, 4, .. up to the number that every fold leaves if None.
    cv : int or cross-validator, default=5
        Number of trajectory folds, or a cross-validator.
    trajectory : int or str, default="trajectory"
        Trajectory column.
    scoring : str or callable, default=None
        The estimator's own score if None.
    n_jobs : int, default=None
        Fits at the same time.
    random_state : int, RandomState or None, default=None
        Seed of the order in which each fold adds trajectories; each size extends the previous one.

    Returns
    -------
    curve : Bunch
        ``n_trajectories`` (n_sizes,), ``test_scores`` (n_sizes, n_folds).

    Examples
    --------
    >>> import numpy as np
    >>> from sklearn.linear_model import LinearRegression
    >>> X = np.c_[np.repeat(np.arange(6), 20), np.random.default_rng(0).normal(size=(120, 2))]
    >>> curve = trajectory_learning_curve(LinearRegression(), X, X @ [0, 1, 2], trajectory=0,
    ...                                   n_trajectories=[1, 2], cv=3)
    >>> curve.test_scores.shape
    (2, 3)
    """
    labels = column_of(X, trajectory, "trajectory")
    splitter = TrajectoryKFold(cv, trajectory=trajectory) if isinstance(cv, int) else cv
    folds = list(splitter.split(X, y))
    available = min(len(np.unique(labels[train])) for train, _ in folds)
    if n_trajectories is None:
        sizes = [2**k for k in range(available.bit_length())]
    else:
        sizes = sorted({int(n) for n in np.atleast_1d(n_trajectories)})
    if sizes[0] < 1 or sizes[-1] > available:
        raise ValueError(
            f"n_trajectories={sizes} must lie between 1 and {available}, the number of "
            "trajectories that every fold leaves for training."
        )
    rng = check_random_state(random_state)
    scorer = check_scoring(estimator, scoring=scoring)
    jobs = []
    for train, test in folds:
        order = rng.permutation(np.unique(labels[train]))
        for size in sizes:
            jobs.append((train[np.isin(labels[train], order[:size])], test))
    scores = Parallel(n_jobs=n_jobs)(
        delayed(_fit_and_score)(clone(estimator), scorer, X, y, train, test) for train, test in jobs
    )
    table = np.reshape(scores, (len(folds), len(sizes))).T
    return Bunch(n_trajectories=np.array(sizes), test_scores=table)


def _fit_and_score(estimator: Any, scorer: Any, X: Any, y: Any, train: Any, test: Any) -> float:
    estimator.fit(_safe_indexing(X, train), _safe_indexing(y, train))
    return float(scorer(estimator, _safe_indexing(X, test), _safe_indexing(y, test)))
