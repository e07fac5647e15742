# SPDX-License-Identifier: BSD-3-Clause
"""The order of rows in time, which random splits of rows destroy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from skidyn._exceptions import LogError
from skidyn._signals import Array

if TYPE_CHECKING:
    from skidyn._keys import Keys

#: Share of steps back in time, or to another trajectory, from which rows count as shuffled.
SHUFFLED = 0.1


def order_in_time(trajectory: NDArray[Any], time: Array | None) -> NDArray[np.intp] | None:
    """Order of shuffled rows by trajectory and time (s); None if they already are in order.

    A log has as many borders as recordings, or a few more if clocks restart. In shuffled rows about
    every second step goes back. Without time no order can be known.
    """
    if time is None or len(time) < 3:
        return None
    switches = trajectory[1:] != trajectory[:-1]
    back = (np.diff(time) < 0) & ~switches
    recordings = len(np.unique(trajectory))
    surplus = int(switches.sum()) - (recordings - 1) + int(back.sum())
    if surplus <= SHUFFLED * len(time):
        return None
    return np.lexsort((time, trajectory))


def refuse_shuffled(what: str, trajectory: NDArray[Any], time: Array | None) -> None:
    """Raise a LogError if rows are shuffled and ``what``, its subject, needs their order."""
    if order_in_time(trajectory, time) is not None:
        raise LogError(
            f"{what} depends on preceding rows, but the rows of X are not in the order of time, "
            "as after train_test_split, KFold(shuffle=True), BaggingRegressor or "
            "HalvingGridSearchCV over samples. Give whole trajectories in the order of time: "
            "split by TrajectoryKFold, GroupKFold or GroupShuffleSplit, or apply it before the "
            "split"
        )


def has_one_motion(trajectory: NDArray[Any], time: Array) -> bool:
    """Whether the rows of each trajectory are one motion, since hardly any time occurs twice."""
    same = trajectory[1:] == trajectory[:-1]
    return bool(np.sum(same & (np.diff(time) == 0)) <= SHUFFLED * len(time))


def time_order(X: NDArray[Any], keys: Keys) -> NDArray[np.intp] | None:
    """Order of the rows by trajectory and time; None if they are in order or have no time."""
    return order_in_time(keys.trajectories(X), None if keys.time is None else X[:, keys.time])


def folds_taken(folds: Any, order: NDArray[np.intp]) -> Any:
    """Pairs of training and test rows in a table whose rows were taken in an order."""
    place = np.argsort(order)
    return folds and [(np.sort(place[a]), np.sort(place[b])) for a, b in folds]


def taken(table: Any, order: NDArray[np.intp] | None) -> Any:
    """Rows of a table in an order; the table itself where either is None."""
    from sklearn.utils import _safe_indexing

    return table if table is None or order is None else _safe_indexing(table, order)
