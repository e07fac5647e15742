# SPDX-License-Identifier: BSD-3-Clause
"""The estimator of the recipe; tests/whole/test_recipes.py runs it."""

from __future__ import annotations

from typing import Any

import numpy as np
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from skidyn._columns import Columns, resolve_columns


class DragRegressor(MultiOutputMixin, RegressorMixin, BaseEstimator):
    """Torque proportional to each joint's own velocity."""

    def __init__(self, robot: Any, trajectory: Any = "auto", time: Any = "auto") -> None:
        self.robot = robot
        self.trajectory = trajectory
        self.time = time

    def fit(self, X: Any, y: Any) -> DragRegressor:
        X, y = validate_data(self, X, y, multi_output=True, y_numeric=True)
        dq = X[:, self._resolve(X.shape[1]).dq]
        torque = y.reshape(len(y), -1)
        self.Fv_ = (dq * torque).sum(0) / np.maximum((dq**2).sum(0), 1e-12)
        self.one_output_ = y.ndim == 1
        return self

    def predict(self, X: Any) -> Any:
        check_is_fitted(self)
        X = validate_data(self, X, reset=False)
        torque = X[:, self._resolve(X.shape[1]).dq] * self.Fv_
        return torque[:, 0] if self.one_output_ else torque

    def _resolve(self, n_features: int) -> Columns:
        names = getattr(self, "feature_names_in_", None)
        return resolve_columns(
            None if names is None else list(names), n_features, self.robot.joint_names,
            trajectory=self.trajectory, time=self.time,
        )  # fmt: skip
