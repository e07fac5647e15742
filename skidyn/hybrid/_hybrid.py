# SPDX-License-Identifier: BSD-3-Clause
"""Physics plus a learner, which is used only if it helps."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from numbers import Integral, Real
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, MetaEstimatorMixin, MultiOutputMixin, RegressorMixin, clone
from sklearn.model_selection import check_cv
from sklearn.utils import _safe_indexing
from sklearn.utils.validation import (
    _check_sample_weight,
    check_is_fitted,
    has_fit_parameter,
)

from skidyn._columns import ColumnSpec
from skidyn._compat import (
    CallbackSupportMixin,
    FitProgress,
    HasMethods,
    Interval,
    fit_context,
    fit_progress,
)
from skidyn._keys import fitted_keys
from skidyn._validation import table_of, validate_motion
from skidyn.hybrid._gate import learned_weights
from skidyn.hybrid._own_joint import OwnJointRegressor
from skidyn.hybrid._range import TrainingRange, distances, fade
from skidyn.model_selection import held_out_folds
from skidyn.preprocessing import without_keys_inside

Array = NDArray[np.float64]

NOT_TESTED = (
    "the learned part is left out: with fewer than three trajectories its gain cannot be "
    "distinguished from chance. Record more, split a long recording of a motion that does not "
    "repeat into trajectories, or set alpha=1 to keep any part that helps on held-out data."
)
NOT_USED = (
    "the learned part is left out: on no joint does it improve held-out trajectories significantly "
    "(smallest p-value {p_value:.2g}, alpha={alpha:g}), so that the hybrid equals the physics. A "
    "real gain becomes significant with more trajectories; `gain_` states that of every joint."
)


class HybridRegressor(
    CallbackSupportMixin, MetaEstimatorMixin, MultiOutputMixin, RegressorMixin, BaseEstimator
):
    """Physical model with a learner for its residual, which is used only if it helps.

    The physics is cross-fitted, so that the learner is trained on the residual of held-out
    trajectories; the learner is also cross-fitted. A learned part is used only if it agrees
    significantly with the residual of held-out trajectories, with a weight reduced by one standard
    error; if no joint uses it, the hybrid equals the physics, with a warning. Far from the training
    samples the learned part fades out.

    Parameters
    ----------
    physics : estimator
        Any scikit-learn regressor, such as ``RBDRegressor``.
    learner : estimator, default=None
        Any scikit-learn regressor; :class:`OwnJointRegressor` if None, with the joint names of the
        physics' ``robot``, if it has one.
    cv : int, cross-validator or iterable of splits, default=5
        Folds: by trajectory, or by blocks of rows of a single trajectory. Others must test every
        row exactly once; for one recording of a periodic motion use ``PhaseKFold``.
    alpha : float, default=0.05
        Level of the one-sided tests over trajectories that the learned part must pass: for all
        joints together, or for a joint alone with correction for their number. 1 keeps the learned
        part of every joint that it improves on held-out data, significantly or not. With fewer than
        three trajectories no test is possible, since parts of one recording are not independent:
        the hybrid then equals the physics, with a warning, unless `alpha` is 1. A long recording of
        a motion that does not repeat may be split into trajectories.
    trajectory, time : int, str or None, default="auto"
        Key columns of X. They are removed for physics and learners without parameters for them.

    Attributes
    ----------
    physics_ : estimator
        Physics fitted to all rows.
    learner_ : estimator or None
        Learner fitted to the residuals on rows left out of the physics; None if no joint uses it.
    learned_weight_ : ndarray of shape (n_joints,)
        Factor of the learned part: its least-squares factor on held-out trajectories less one
        standard error, between 0 and 1; 0 if it is not used.
    gain_ : ndarray of shape (n_joints,)
        Relative reduction of the RMSE on held-out trajectories by the learned part, with the weight
        from the other trajectories, whether it is used or not.
    p_value_ : ndarray of shape (n_joints,)
        Corrected p-value of the agreement of residual and learned part on the joint, or over all
        joints if that is smaller. 1 without improvement, and with fewer than three trajectories.
    radius_ : float
        Distance from the training samples that counts as outside, in standard deviations per
        feature (root mean square).
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Names of the columns, if X has names.

    Notes
    -----
    Physics is fitted once for every pair of folds: a learner that is evaluated on a fold is trained
    on residuals of physics fitted without this fold and without the fold of the row.

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

    __metadata_request__fit = {"sample_weight": True, "groups": True}
    __metadata_request__score = {"sample_weight": True}

    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {
        "physics": [HasMethods(["fit", "predict"])],
        "learner": [HasMethods(["fit", "predict"]), None],
        "cv": [Interval(Integral, 2, None, closed="left"), HasMethods(["split"]), Iterable],
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

    @fit_context(prefer_skip_nested_validation=False)
    def fit(self, X: Any, y: Any, sample_weight: Any = None, groups: Any = None) -> HybridRegressor:
        """Fit the physics, then the learner on its residual.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            Features, with key columns.
        y : array-like of shape (n_samples,) or (n_samples, n_joints), N m (N if prismatic)
            Torque.
        sample_weight : array-like of shape (n_samples,), default=None
            Weight of each row, for physics and learners that accept weights.
        groups : array-like of shape (n_samples,), default=None
            Groups of the rows for a `cv` that splits by groups, such as ``GroupKFold``.

        Returns
        -------
        self : object
            The fitted hybrid.
        """
        array, torque = validate_motion(
            self, X, y, multi_output=True, y_numeric=True, dtype=np.float64
        )
        table = table_of(self, X, array)
        self._one_dimensional = torque.ndim == 1
        weight = None
        if sample_weight is not None:
            weight = _check_sample_weight(sample_weight, array, dtype=np.float64)
        keys = fitted_keys(self)
        folds = self._folds(table, torque, keys.trajectories(array), groups)
        n_fits = len(folds) * (len(folds) + 3) // 2 + 2  # pairs of folds, folds, and all rows
        with fit_progress(self, n_fits, X, y, "model") as progress:
            self._learn(table, array, torque, weight, folds, progress)
        return self

    def _learn(
        self,
        table: Any,
        array: Array,
        torque: Array,
        weight: Array | None,
        folds: list[Any],
        progress: FitProgress,
    ) -> None:
        keys = fitted_keys(self)
        learner = self._own_joints() if self.learner is None else self.learner
        learner = without_keys_inside(learner, keys)
        physics = without_keys_inside(self.physics, keys)
        seen_by_physics = keys.for_learner(table, physics)
        residuals = _honest_residuals(physics, seen_by_physics, torque, weight, folds, progress)
        table = keys.for_learner(table, learner)
        residual, learned = np.zeros(torque.shape), np.zeros(torque.shape)
        for (train, test), seen in zip(folds, residuals, strict=True):
            residual[test] = seen[test]
            part = None if weight is None else weight[train]
            fitted = _fit(clone(learner), _safe_indexing(table, train), seen[train], part, progress)
            predicted = fitted.predict(_safe_indexing(table, test))
            learned[test] = np.reshape(predicted, residual[test].shape)

        training_range = TrainingRange(array[:, list(keys.features)], folds)
        self.radius_ = training_range.radius
        self._scale, self._reference = training_range.scale, training_range.reference
        learned *= _column(fade(training_range.held_out_novelty), learned)

        shape = (len(array), -1)
        unit = keys.trajectories(array)
        tested = len(np.unique(unit)) > 2
        self.learned_weight_, self.gain_, self.p_value_ = learned_weights(
            residual.reshape(shape),
            learned.reshape(shape),
            unit if tested else _fold_numbers(len(array), folds),
            self.alpha if tested else float(self.alpha == 1),
        )
        if not tested:
            self.p_value_[:] = 1.0
            if self.alpha < 1:
                warnings.warn(NOT_TESTED, UserWarning, stacklevel=4)
        elif not self.learned_weight_.any():
            least = float(self.p_value_.min())
            told = NOT_USED.format(p_value=least, alpha=self.alpha)
            warnings.warn(told, UserWarning, stacklevel=4)
        self.physics_ = _fit(clone(physics), seen_by_physics, torque, weight, progress)
        self.learner_ = None
        if self.learned_weight_.any():
            self.learner_ = _fit(clone(learner), table, residual, weight, progress)

    def _folds(
        self, table: Any, torque: Array, trajectories: NDArray[Any], groups: Any
    ) -> list[Any]:
        if isinstance(self.cv, Integral):
            return held_out_folds(trajectories, int(self.cv))
        folds = list(check_cv(self.cv).split(table, torque, groups))
        tested = np.sort(np.concatenate([test for _, test in folds]))
        if not np.array_equal(tested, np.arange(len(torque))):
            raise ValueError("cv must test every row exactly once, as KFold does.")
        return folds

    def _own_joints(self) -> OwnJointRegressor:
        # columns may be named after the joints of the physics
        names = getattr(getattr(self.physics, "robot", None), "joint_names", None)
        return OwnJointRegressor(joint_names=names, trajectory=self.trajectory, time=self.time)

    def predict(self, X: Any) -> Array:
        """Predict the torque: physics, plus the learned part if it is used.

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
        array = validate_motion(self, X, reset=False, dtype=np.float64)
        table = table_of(self, X, array)
        physics = self.physics_.predict(fitted_keys(self).for_learner(table, self.physics_))
        return self._shaped(physics) + self._learned(table, array)

    def learned_torque(self, X: Any) -> Array:
        """Learned part of the prediction: weighted per joint and faded out of range.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            As in fit.

        Returns
        -------
        torque : ndarray of shape (n_samples,) or (n_samples, n_joints), N m (N if prismatic)
            Zero if the learner is not used.
        """
        check_is_fitted(self)
        array = validate_motion(self, X, reset=False, dtype=np.float64)
        return self._learned(table_of(self, X, array), array)

    def _learned(self, table: Any, array: Array) -> Array:
        learned = np.zeros((len(array), len(self.learned_weight_)))
        if self.learner_ is not None:
            own = fitted_keys(self).for_learner(table, self.learner_)
            learned += np.reshape(self.learner_.predict(own), learned.shape)
            learned *= self.learned_weight_ * fade(self._novelty(array))[:, None]
        return self._shaped(learned)

    def _shaped(self, torque: Any) -> Array:
        shape = (-1,) if self._one_dimensional else (-1, len(self.learned_weight_))
        return np.reshape(np.asarray(torque, dtype=np.float64), shape)

    def _novelty(self, array: Array) -> Array:
        features = array[:, list(fitted_keys(self).features)]
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
            True where the nearest training sample is farther than `radius_`. The learned part fades
            out from there and is zero at twice that distance.
        """
        check_is_fitted(self)
        return self._novelty(validate_motion(self, X, reset=False, dtype=np.float64)) > 1.0


def _column(factor: Array, values: Array) -> Array:
    return factor[:, None] if values.ndim == 2 else factor


def _fit(estimator: Any, X: Any, y: Array, weight: Array | None, progress: FitProgress) -> Any:
    progress.begin_step()
    _fit_weighted(estimator, X, y, weight)
    progress.end_step()
    return estimator


def _fit_weighted(estimator: Any, X: Any, y: Array, weight: Array | None) -> Any:
    if weight is None:
        return estimator.fit(X, y)
    if not has_fit_parameter(estimator, "sample_weight"):
        raise ValueError(
            f"{type(estimator).__name__} does not accept sample_weight; fit without it."
        )
    return estimator.fit(X, y, sample_weight=weight)


def _honest_residuals(
    physics: Any,
    X: Any,
    y: Array,
    weight: Array | None,
    folds: list[Any],
    progress: FitProgress,
) -> Array:
    """For every fold, residuals of all rows by physics fitted without it and without their fold.

    If physics is fitted to a fold, its residual elsewhere contains the fold's own deviation with
    the opposite sign, so a learner of this residual seems worse on the fold than it is. Physics
    fitted without two folds serves for both. If no rows are left without two folds, the fit
    includes the fold of the rows.
    """

    def fitted(rows: NDArray[Any]) -> Any:
        part = None if weight is None else weight[rows]
        return _fit(clone(physics), _safe_indexing(X, rows), y[rows], part, progress)

    residuals = np.repeat(y[None].astype(np.float64), len(folds), axis=0)
    for k, (train, test) in enumerate(folds):
        residuals[k] -= np.reshape(fitted(train).predict(X), y.shape)
        for c, (others, tested) in enumerate(folds[:k]):
            both = np.intersect1d(train, others)
            if len(both):
                model = fitted(both)
                for number, rows in ((k, tested), (c, test)):
                    predicted = model.predict(_safe_indexing(X, rows))
                    residuals[number][rows] = y[rows] - np.reshape(predicted, y[rows].shape)
    return residuals


def _fold_numbers(n_rows: int, folds: list[Any]) -> NDArray[Any]:
    number = np.zeros(n_rows, dtype=int)
    for k, (_, test) in enumerate(folds):
        number[test] = k
    return number
