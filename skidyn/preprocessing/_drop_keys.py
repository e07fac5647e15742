# SPDX-License-Identifier: BSD-3-Clause
"""Features without key columns, which a learner without support for them would memorise."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone
from sklearn.pipeline import Pipeline, make_pipeline

from skidyn._columns import ColumnSpec
from skidyn._keys import Keys, fitted_keys, knows_keys
from skidyn._validation import motion_of
from skidyn.preprocessing._signals import SignalTransformer

Array = NDArray[np.float64]


class DropKeys(SignalTransformer):
    """Remove the key columns from a table, before a learner that does not support them.

    Otherwise a learner uses the trajectory number and the time as features, and memorises the log.
    Columns of torque, with which it would predict torque from itself, are left out as well.
    ``HybridRegressor`` and ``BLLRegressor`` remove them for their learners automatically.

    Parameters
    ----------
    trajectory, time : int, str or None, default="auto"
        Key columns, which are dropped.

    Attributes
    ----------
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Names of the columns, if X has names.

    Examples
    --------
    >>> import pandas as pd
    >>> from sklearn.linear_model import Ridge
    >>> from sklearn.pipeline import make_pipeline
    >>> from skidyn.preprocessing import DropKeys
    >>> X = pd.DataFrame({"trajectory": [1, 1, 2], "time": [0.0, 0.1, 0.0], "q1": [0.2, 0.3, 0.4]})
    >>> make_pipeline(DropKeys(), Ridge()).fit(X, [2.0, 3.0, 4.0])[-1].n_features_in_
    1
    """

    gives_signals = False

    def __init__(self, *, trajectory: ColumnSpec = "auto", time: ColumnSpec = "auto") -> None:
        self.trajectory = trajectory
        self.time = time

    def _table(self, X: Any) -> Any:
        return motion_of(self, X)

    def _learn(self, X: Array) -> None:
        fitted_keys(self)  # raises an error for missing columns

    def _changed(self, X: Array) -> Array:
        return X[:, list(fitted_keys(self).features)]

    def _renamed(self, names: NDArray[Any]) -> NDArray[Any]:
        return names[list(fitted_keys(self).features)]


def without_keys_inside(learner: Any, keys: Keys) -> Any:
    """The learner, or a copy, whose parts without support for key columns do not get them.

    Steps of a ``Pipeline`` after the last one that supports key columns, and members of stackings
    and votings that do not support them, get a :class:`DropKeys`, unless there is one already. (A
    learner without any part that supports key columns never gets them: ``Keys.for_learner``.)
    """
    if (keys.trajectory is None and keys.time is None) or not knows_keys(learner):
        return learner
    drop = DropKeys(trajectory=keys.trajectory, time=keys.time)
    if _drops_keys(learner):
        return learner
    if isinstance(learner, Pipeline):
        knowing = [k for k, (_, step) in enumerate(learner.steps) if knows_keys(step)]
        last = knowing[-1]
        steps = list(clone(learner).steps)
        if last == len(steps) - 1:
            steps[-1] = (steps[-1][0], without_keys_inside(steps[-1][1], keys))
        else:
            # transformers of signals pass key columns on in their positions
            steps.insert(last + 1, ("drop_keys", drop))
        return learner.__class__(**{**learner.get_params(deep=False), "steps": steps})
    if isinstance(getattr(learner, "estimators", None), list):
        members = [
            (name, without_keys_inside(m, keys) if knows_keys(m) else make_pipeline(drop, m))
            for name, m in learner.estimators
        ]
        return clone(learner).set_params(estimators=members)
    return learner


def _drops_keys(learner: Any) -> bool:
    """Whether a step of a Pipeline removes the key columns already."""
    if isinstance(learner, Pipeline):
        return any(_drops_keys(step) for _, step in learner.steps)
    return isinstance(learner, DropKeys)
