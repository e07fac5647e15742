# SPDX-License-Identifier: BSD-3-Clause
"""One regressor per joint on that joint's own signals."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from numbers import Integral
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, MetaEstimatorMixin, MultiOutputMixin, RegressorMixin, clone
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.utils.parallel import Parallel, delayed
from sklearn.utils.validation import (
    _check_sample_weight,
    check_is_fitted,
    has_fit_parameter,
)

from skidyn._columns import Columns, ColumnSpec, resolve_columns
from skidyn._compat import HasMethods, fit_context
from skidyn._exceptions import ColumnError
from skidyn._keys import fitted_keys
from skidyn._order import taken, time_order
from skidyn._validation import validate_motion
from skidyn.effects import dahl_state
from skidyn.model_selection import order_of_log

Array = NDArray[np.float64]


class OwnJointRegressor(MetaEstimatorMixin, MultiOutputMixin, RegressorMixin, BaseEstimator):
    """One regressor per joint on that joint's own motion and pre-sliding states.

    The residual of a good physical model is mostly friction of single joints. A learner that only
    uses the motion of the predicted joint cannot fit accidental relations between joints, needs
    less data and generalises better to new motions. Friction depends on the path: near rest and
    reversals it depends on the distance travelled since then. States of Dahl's model [1]_ with
    several widths represent this memory for learners without one.

    Parameters
    ----------
    estimator : estimator, default=None
        Regressor of one joint; a small, cautious gradient boosting if None.
    presliding : sequence of float, rad (m for prismatic joints), default=(0.003, 0.01, 0.05, 0.2)
        Distances over which the states build up. They restart in each segment.
    joint_names : sequence of str, default=None
        Names of the joints for columns named ``q_<joint>``; not needed for ``q1, q2, ..`` or
        columns by position.
    n_jobs : int, default=None
        Joints fitted at the same time.
    trajectory, time : int, str or None, default="auto"
        Key columns of X.

    Attributes
    ----------
    estimators_ : list of estimators
        One per joint.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Names of the columns, if X has names.

    References
    ----------
    .. [1] P. R. Dahl, "A solid friction model", Aerospace Corporation TOR-0158, 1968.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.hybrid import OwnJointRegressor
    >>> from sklearn.linear_model import Ridge
    >>> X = np.random.default_rng(0).normal(size=(50, 6))  # q, dq, ddq of two joints
    >>> OwnJointRegressor(Ridge()).fit(X, X[:, 2:4]).predict(X).shape
    (50, 2)
    """

    __metadata_request__fit = {"sample_weight": True}
    __metadata_request__score = {"sample_weight": True}

    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {
        "estimator": [HasMethods(["fit", "predict"]), None],
        "presliding": ["array-like"],
        "joint_names": ["array-like", None],
        "n_jobs": [Integral, None],
        "trajectory": [str, Integral, None],
        "time": [str, Integral, None],
    }

    def __init__(
        self,
        estimator: Any = None,
        *,
        presliding: Sequence[float] = (0.003, 0.01, 0.05, 0.2),
        joint_names: Sequence[str] | None = None,
        n_jobs: int | None = None,
        trajectory: ColumnSpec = "auto",
        time: ColumnSpec = "auto",
    ) -> None:
        self.estimator = estimator
        self.presliding = presliding
        self.joint_names = joint_names
        self.n_jobs = n_jobs
        self.trajectory = trajectory
        self.time = time

    @fit_context(prefer_skip_nested_validation=False)
    def fit(self, X: Any, y: Any, sample_weight: Any = None) -> OwnJointRegressor:
        """Fit one regressor per joint.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            Positions, velocities and accelerations of all joints, with key columns.
        y : array-like of shape (n_samples,) or (n_samples, n_joints), N m (N if prismatic)
            Torque, or the residual of a physical model.
        sample_weight : array-like of shape (n_samples,), default=None
            Weight of each row, if the regressor of a joint accepts weights.

        Returns
        -------
        self : object
            The fitted regressor.
        """
        ways = np.asarray(self.presliding, dtype=float)
        if not (np.isfinite(ways) & (ways > 0)).all():
            raise ValueError(
                f"presliding={self.presliding!r}; expected distances above 0, in rad or m, such as "
                "(0.01, 0.05)"
            )
        X, y = validate_motion(self, X, y, multi_output=True, y_numeric=True, dtype=np.float64)
        self._one_dimensional = y.ndim == 1
        targets = y.reshape(len(y), -1)
        self._n_outputs = targets.shape[1]
        self._columns = self._resolve(self._n_outputs)
        order_of_log(self, X, fitted_keys(self))
        base = _cautious_boosting() if self.estimator is None else self.estimator
        features = self._features(X)
        weights = {}
        if sample_weight is not None:
            if not has_fit_parameter(base, "sample_weight"):
                raise ValueError(
                    f"{type(base).__name__} does not accept sample_weight; fit without it."
                )
            weights["sample_weight"] = _check_sample_weight(sample_weight, X, dtype=np.float64)
        self.estimators_ = Parallel(n_jobs=self.n_jobs)(
            delayed(clone(base).fit)(own, targets[:, j], **weights)
            for j, own in enumerate(features)
        )
        return self

    def _resolve(self, n_joints: int) -> Columns | None:
        names = getattr(self, "feature_names_in_", None)
        joints = self.joint_names
        features = fitted_keys(self).features
        if names is None and joints is None and len(features) != 3 * n_joints:
            warnings.warn(
                f"X has {len(features)} columns without names; the motion of {n_joints} joint(s) "
                f"has {3 * n_joints} (q, dq, ddq). Every joint is learned from all columns, "
                "without pre-sliding states.",
                UserWarning,
                stacklevel=4,
            )
            return None
        if joints is None and names is not None:
            there = sum(re.fullmatch(r"q\d+", str(name)) is not None for name in names)
            if there > n_joints:
                raise ColumnError(
                    f"X has the motion of {there} joints, and y the torque of {n_joints}, of which "
                    "numbers do not tell whose it is: give the torque of every joint, or name the "
                    "columns after them (q_elbow, dq_elbow, ..) and give joint_names=['elbow']"
                )
        if joints is None:
            joints = [str(j + 1) for j in range(n_joints)]
        try:
            return resolve_columns(
                None if names is None else list(names),
                self.n_features_in_,
                list(joints),
                trajectory=self.trajectory,
                time=self.time,
            )
        except ColumnError as error:
            if self.joint_names is not None or names is None:
                raise
            raise ColumnError(f"{error} Columns with other names need joint_names.") from None

    def _features(self, X: Array) -> list[Array]:
        columns = self._columns
        if columns is None:
            return [X[:, list(fitted_keys(self).features)]] * self._n_outputs
        assert columns.ddq is not None
        keys = fitted_keys(self)
        order = time_order(X, keys)
        X = taken(X, order)
        segments = keys.segments(X)
        own = []
        for q, dq, ddq in zip(columns.q, columns.dq, columns.ddq, strict=True):
            states = [dahl_state(X[:, q], segments, float(way)) for way in self.presliding]
            own.append(np.column_stack([X[:, [q, dq, ddq]], *states]))
        return own if order is None else [table[np.argsort(order)] for table in own]

    def predict(self, X: Any) -> Array:
        """Predict the torque of every row.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            As in fit.

        Returns
        -------
        y : ndarray of shape (n_samples,) or (n_samples, n_joints), N m (N if prismatic)
            Predicted torque.
        """
        check_is_fitted(self)
        X = validate_motion(self, X, reset=False, dtype=np.float64)
        torque = np.stack(
            [
                estimator.predict(own)
                for estimator, own in zip(self.estimators_, self._features(X), strict=True)
            ],
            axis=1,
        )
        return torque[:, 0] if self._one_dimensional else torque


def _cautious_boosting() -> HistGradientBoostingRegressor:
    return HistGradientBoostingRegressor(
        max_iter=100,
        learning_rate=0.1,
        max_leaf_nodes=15,
        min_samples_leaf=50,
        early_stopping=False,
        random_state=0,
    )
