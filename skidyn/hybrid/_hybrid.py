# SPDX-License-Identifier: BSD-3-Clause
"""Physics plus a learner that knows when to add nothing."""

from __future__ import annotations

from numbers import Integral, Real
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, MetaEstimatorMixin, RegressorMixin, clone
from sklearn.utils import _safe_indexing
from sklearn.utils.validation import (
    _check_sample_weight,
    check_is_fitted,
    has_fit_parameter,
    validate_data,
)

from skidyn._columns import ColumnSpec, column_names
from skidyn._compat import HasMethods, Interval, fit_context
from skidyn.hybrid._gate import learned_weights
from skidyn.hybrid._own_joint import OwnJointRegressor
from skidyn.hybrid._range import TrainingRange, distances, fade
from skidyn.model_selection._split import held_out_folds
from skidyn.preprocessing._keys import Keys, resolve_keys

Array = NDArray[np.float64]


class HybridRegressor(MetaEstimatorMixin, RegressorMixin, BaseEstimator):
    """Physical model plus a learner on its residual, which is kept only where it helps.

    The physics is cross-fitted, so that the learner sees the residual on trajectories that the
    physics has not seen; the learner is cross-fitted in turn. A joint keeps its learned part only
    if the gain on held-out trajectories is significant, weighted by how well it held; otherwise the
    hybrid is the physics. Far from the training samples the learned part fades out.

    Parameters
    ----------
    physics : estimator
        Any scikit-learn regressor, such as ``RBDRegressor``.
    learner : estimator, default=None
        Any scikit-learn regressor; :class:`OwnJointRegressor` if None.
    cv : int or cross-validator, default=5
        Folds: by trajectory, or by blocks of rows of a single trajectory. A cross-validator must
        test every row exactly once; for one recording of a periodic motion use ``PhaseKFold``.
    alpha : float, default=0.05
        Level of the one-sided paired tests over trajectories that the learned part must pass: for
        all joints together, or for a joint alone with correction for their number. 1 keeps every
        joint whose learned part helped on held-out trajectories, significantly or not.
    trajectory, time : int, str or None, default="auto"
        Key columns of X.

    Attributes
    ----------
    physics_ : estimator
        Physics fitted to all rows.
    learner_ : estimator or None
        Learner fitted to all honest residuals; None where no joint kept it.
    learned_weight_ : ndarray of shape (n_joints,)
        Factor of the learned part; 0 where it is off.
    gain_ : ndarray of shape (n_joints,)
        Relative fall of the RMSE on held-out trajectories that the learned part brought, whether
        it was kept or not.
    p_value_ : ndarray of shape (n_joints,)
        Of that gain, or of the mean gain of all joints if that is surer; corrected.
    radius_ : float
        Distance from the training samples that counts as outside, in standard deviations per
        feature (root mean square).
    n_features_in_ : int
        Columns of X.
    feature_names_in_ : ndarray of str
        Their names, where X has names.

    Notes
    -----
    When a fold's residual is predicted, the learner was trained on residuals of physics that saw
    the fold. A physical model has few parameters, so this is a small leak; nesting would remove it
    at the cost of another round of fits per fold.

    Examples
    --------
    >>> import numpy as np
    >>> from sklearn.ensemble import ExtraTreesRegressor
    >>> from sklearn.linear_model import LinearRegression
    >>> from skidyn.hybrid import HybridRegressor
    >>> rng = np.random.default_rng(0)
    >>> X = np.c_[np.repeat(np.arange(6), 50), rng.uniform(-1, 1, size=(300, 2))]
    >>> y = np.c_[X[:, 1] + np.sin(4 * X[:, 1]), X[:, 2]] + 0.05 * rng.normal(size=(300, 2))
    >>> learner = ExtraTreesRegressor(20, random_state=0)
    >>> hybrid = HybridRegressor(LinearRegression(), learner, trajectory=0).fit(X, y)
    >>> (hybrid.learned_weight_ > 0).tolist()  # nothing to learn on the second joint
    [True, False]
    >>> hybrid.outside_range([[0.0, 0.1, 0.1], [0.0, 9.0, 9.0]]).tolist()
    [False, True]
    """

    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {
        "physics": [HasMethods(["fit", "predict"])],
        "learner": [HasMethods(["fit", "predict"]), None],
        "cv": [Interval(Integral, 2, None, closed="left"), HasMethods(["split"])],
        "alpha": [Interval(Real, 0, 1, closed="both")],
        "trajectory": [str, Integral, None],
        "time": [str, Integral, None],
    }

    def __init__(
        self,
        physics: Any,
        learner: Any = None,
        *,
        cv: Any = 5,
        alpha: float = 0.05,
        trajectory: ColumnSpec = "auto",
        time: ColumnSpec = "auto",
    ) -> None:
        self.physics = physics
        self.learner = learner
        self.cv = cv
        self.alpha = alpha
        self.trajectory = trajectory
        self.time = time

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        return tags

    @fit_context(prefer_skip_nested_validation=False)
    def fit(self, X: Any, y: Any, sample_weight: Any = None) -> HybridRegressor:
        """Fit the physics, then the learner on what it leaves over.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            Features, with key columns.
        y : array-like of shape (n_samples,) or (n_samples, n_joints), N m (N if prismatic)
            Torque.
        sample_weight : array-like of shape (n_samples,), default=None
            Weight of each row, for physics and learners that take weights.

        Returns
        -------
        self : object
            The fitted hybrid.
        """
        array, torque = validate_data(
            self, X, y, multi_output=True, y_numeric=True, dtype=np.float64
        )
        table = _like(X, array)
        self._one_dimensional = torque.ndim == 1
        weight = None
        if sample_weight is not None:
            weight = _check_sample_weight(sample_weight, array, dtype=np.float64)
        keys = self._keys()
        folds = self._folds(table, torque, keys.trajectories(array))
        learner = OwnJointRegressor() if self.learner is None else self.learner
        if self.learner is None:
            learner.set_params(trajectory=self.trajectory, time=self.time)
        residual = torque - _cross_fitted(self.physics, table, torque, weight, folds)
        learned = _cross_fitted(learner, table, residual, weight, folds)

        training_range = TrainingRange(array[:, list(keys.features)], folds)
        self.radius_ = training_range.radius
        self._scale, self._reference = training_range.scale, training_range.reference
        learned *= _column(fade(training_range.held_out_novelty), learned)

        shape = (len(array), -1)
        self.learned_weight_, self.gain_, self.p_value_ = learned_weights(
            residual.reshape(shape), learned.reshape(shape), _units(keys, array, folds), self.alpha
        )
        self.physics_ = _fit(clone(self.physics), table, torque, weight)
        self.learner_ = None
        if self.learned_weight_.any():
            self.learner_ = _fit(clone(learner), table, residual, weight)
        return self

    def _folds(self, table: Any, torque: Array, trajectories: NDArray[Any]) -> list[Any]:
        if not hasattr(self.cv, "split"):
            return held_out_folds(trajectories, self.cv)
        folds = list(self.cv.split(table, torque))
        tested = np.sort(np.concatenate([test for _, test in folds]))
        if not np.array_equal(tested, np.arange(len(torque))):
            raise ValueError("cv must test every row exactly once, as KFold does.")
        return folds

    def _keys(self) -> Keys:
        names = getattr(self, "feature_names_in_", None)
        return resolve_keys(
            None if names is None else list(names),
            self.n_features_in_,
            trajectory=self.trajectory,
            time=self.time,
        )

    def predict(self, X: Any) -> Array:
        """Predict the torque: physics, plus the learned part where it was kept.

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
        array = validate_data(self, X, reset=False, dtype=np.float64)
        table = _like(X, array)
        return self._shaped(self.physics_.predict(table)) + self._learned(table, array)

    def learned_torque(self, X: Any) -> Array:
        """Learned part of the prediction: weighted per joint and faded out of range.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            As in fit.

        Returns
        -------
        torque : ndarray of shape (n_samples,) or (n_samples, n_joints), N m (N if prismatic)
            Zero where the learner is off.
        """
        check_is_fitted(self)
        array = validate_data(self, X, reset=False, dtype=np.float64)
        return self._learned(_like(X, array), array)

    def _learned(self, table: Any, array: Array) -> Array:
        learned = np.zeros((len(array), len(self.learned_weight_)))
        if self.learner_ is not None:
            learned += np.reshape(self.learner_.predict(table), learned.shape)
            learned *= self.learned_weight_ * fade(self._novelty(array))[:, None]
        return self._shaped(learned)

    def _shaped(self, torque: Any) -> Array:
        shape = (-1,) if self._one_dimensional else (-1, len(self.learned_weight_))
        return np.reshape(np.asarray(torque, dtype=np.float64), shape)

    def _novelty(self, array: Array) -> Array:
        features = array[:, list(self._keys().features)]
        return distances(features, self._scale, self._reference) / self.radius_

    def outside_range(self, X: Any) -> NDArray[np.bool_]:
        """Which samples lie outside the range of the training samples.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            As in fit.

        Returns
        -------
        outside : ndarray of bool of shape (n_samples,)
            True where the nearest training sample is farther than `radius_`. The learned part
            fades out from there and is gone at twice that distance.
        """
        check_is_fitted(self)
        return self._novelty(validate_data(self, X, reset=False, dtype=np.float64)) > 1.0


def _like(X: Any, array: Array) -> Any:
    """X as the user gave it where it has names, otherwise the checked array."""
    return array if column_names(X) is None else X


def _column(factor: Array, values: Array) -> Array:
    return factor[:, None] if values.ndim == 2 else factor


def _fit(estimator: Any, X: Any, y: Array, weight: Array | None) -> Any:
    if weight is None:
        return estimator.fit(X, y)
    if not has_fit_parameter(estimator, "sample_weight"):
        raise ValueError(f"{type(estimator).__name__} takes no sample_weight; fit without it.")
    return estimator.fit(X, y, sample_weight=weight)


def _cross_fitted(
    estimator: Any, X: Any, y: Array, weight: Array | None, folds: list[Any]
) -> Array:
    """Prediction of every row by a clone that has not seen its fold."""
    predicted = np.zeros_like(y, dtype=np.float64)
    for train, test in folds:
        part = None if weight is None else weight[train]
        fitted = _fit(clone(estimator), _safe_indexing(X, train), y[train], part)
        predicted[test] = np.reshape(fitted.predict(_safe_indexing(X, test)), y[test].shape)
    return predicted


def _units(keys: Keys, array: Array, folds: list[Any]) -> NDArray[Any]:
    """What the test of the gain counts as independent: trajectories, or folds of a single one."""
    trajectories = keys.trajectories(array)
    if len(np.unique(trajectories)) > 2:
        return trajectories
    unit = np.zeros(len(array), dtype=int)
    for k, (_, test) in enumerate(folds):
        unit[test] = k
    return unit
