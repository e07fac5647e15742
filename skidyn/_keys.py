# SPDX-License-Identifier: BSD-3-Clause
"""Key columns (trajectory, time) of a table whose other columns are features of any kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._columns import ColumnSpec, column_names, key_columns
from skidyn._exceptions import ColumnError
from skidyn._signals import find_segments


@dataclass(frozen=True)
class Keys:
    """Positions of the key columns of X, if it has them, and of all other columns."""

    trajectory: int | None
    time: int | None
    features: tuple[int, ...]

    def trajectories(self, X: NDArray[Any]) -> NDArray[Any]:
        """Trajectory number of every row; zeros if there is no such column."""
        return np.zeros(len(X), dtype=int) if self.trajectory is None else X[:, self.trajectory]

    def segments(self, X: NDArray[Any]) -> list[slice]:
        """Contiguous runs of rows that no window, filter or state may leave."""
        time = None if self.time is None else X[:, self.time]
        return find_segments(self.trajectories(X), time)

    def for_learner(self, X: Any, learner: Any) -> Any:
        """The columns for a learner: without key columns, unless it has parameters for them.

        A learner, or its parts, without parameters for trajectory and time would use them as
        features and memorise the log.
        """
        if knows_keys(learner):
            return X
        if self.trajectory is None and self.time is None:
            return X
        from sklearn.utils import _safe_indexing

        return _safe_indexing(X, list(self.features), axis=1)


def knows_keys(learner: Any) -> bool:
    """Whether an estimator, or a part of it, has parameters for key columns."""
    parameters = learner.get_params() if hasattr(learner, "get_params") else {}
    return any(name.rpartition("__")[2] == "trajectory" for name in parameters)


def resolve_keys(
    names: Sequence[str] | None,
    n_features: int,
    *,
    trajectory: ColumnSpec = "auto",
    time: ColumnSpec = "auto",
) -> Keys:
    """Find the key columns; all others are features. Names are None for an array.

    >>> resolve_keys(["time", "q1", "dq1"], 3)
    Keys(trajectory=None, time=0, features=(1, 2))
    """
    names = None if names is None else [str(name) for name in names]
    found = key_columns(names, n_features, trajectory, time)
    features = tuple(i for i in range(n_features) if i not in found)
    if not features:
        raise ColumnError(
            f"0 feature(s) are left of the {n_features} column(s) of X without the key columns; "
            "at least one is required."
        )
    return Keys(found[0], found[1], features)


def fitted_keys(estimator: Any) -> Keys:
    """Key columns of the table of an estimator that is fitted as far as ``n_features_in_``."""
    names = getattr(estimator, "feature_names_in_", None)
    return resolve_keys(
        None if names is None else [str(name) for name in names],
        estimator.n_features_in_,
        trajectory=estimator.trajectory,
        time=estimator.time,
    )


def keys_of(X: Any, *, trajectory: ColumnSpec = "auto", time: ColumnSpec = "auto") -> Keys:
    """Key columns of a table or array given by the user."""
    return resolve_keys(column_names(X), X.shape[1], trajectory=trajectory, time=time)
