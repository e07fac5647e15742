# SPDX-License-Identifier: BSD-3-Clause
"""Order of shuffled rows for estimators that use earlier rows."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._keys import Keys
from skidyn._order import time_order
from skidyn.model_selection._leakage import LeakageWarning


def order_of_log(estimator: Any, X: NDArray[Any], keys: Keys) -> NDArray[np.intp] | None:
    """Order of the rows of a fit by trajectory and time, with a warning if they are shuffled."""
    order = time_order(X, keys)
    if order is not None:
        warnings.warn(
            f"{type(estimator).__name__} predicts a row from the rows before it, but the rows of "
            "X are not in the order of time, as after train_test_split or KFold(shuffle=True). "
            "They are sorted by trajectory and time; rows with missing predecessors are "
            "predicted without them. Hold out whole trajectories: TrajectoryKFold, GroupKFold or "
            "GroupShuffleSplit, and resource='max_epochs' in HalvingGridSearchCV",
            LeakageWarning,
            stacklevel=4,
        )
    return order
