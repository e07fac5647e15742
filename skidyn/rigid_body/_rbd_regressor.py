# SPDX-License-Identifier: BSD-3-Clause
"""Rigid-body dynamics with physical effects, identified from data, as a scikit-learn regressor."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any, Literal

import numpy as np
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.metaestimators import available_if
from sklearn.utils.validation import check_is_fitted, validate_data

from skidyn._checks import warn_about_log
from skidyn._columns import Columns, ColumnSpec, resolve_columns
from skidyn._exceptions import ColumnError
from skidyn._signals import Array, Signals, signals_from
from skidyn.effects import Term, get_effect, make_terms
from skidyn.evidence._broken import broken_notes
from skidyn.evidence._evidence import Evidence
from skidyn.evidence._from_motion import evidence_of_rows, renumbered, sample_blocks
from skidyn.evidence._kinematics import smooth_motion
from skidyn.evidence._problem import (
    hysteresis_joints,
    make_problem,
    term_columns,
)
from skidyn.evidence._streaming import evidence_of_signals, linear_terms
from skidyn.rigid_body._base_parameters import find_base_parameters
from skidyn.rigid_body._constraints import BodyConstraints
from skidyn.rigid_body._estimators import ESTIMATORS, Estimator, find_estimator
from skidyn.rigid_body._identifiability import condition_number
from skidyn.rigid_body._instrumental import instrument_rows
from skidyn.rigid_body._regression import Regression, Solution
from skidyn.rigid_body._results import Results
from skidyn.rigid_body._terms import find_terms, is_linear, needs_model
from skidyn.rigid_body._uncertainty import PredictionBands, find_bands, sample_folds
from skidyn.robots import Robot

#: Groups of trajectories whose evidence partial_fit keeps apart, for standard errors.
GROUPS = 20


def _keeps_no_rows(model: RBDRegressor) -> bool:
    """Whether evidence is enough for the estimator of a model."""
    if getattr(ESTIMATORS.get(model.estimator), "rows", False):
        raise AttributeError(
            f"estimator={model.estimator!r} looks at single rows, which partial_fit does not keep; "
            "use fit, or another estimator"
        )
    return True


class RBDRegressor(Results, RegressorMixin, BaseEstimator):
    """Inverse dynamics of a robot: rigid body plus effects, identified together.

    Parameters
    ----------
    robot : Robot, str or path
        Robot, or its URDF.
    effects : sequence of str, (str, joints) or Term, default=("viscous", "coulomb")
        Effects beside the rigid body: ``"viscous"`` on all joints, ``("dahl", [1, 4])`` on some
        (counted from 1), or a :class:`~skidyn.effects.Term` with its shape parameters. Shape
        parameters that are not given are searched.
    parameters : {"identified", "nominal"}, default="identified"
        Whether inertial parameters are identified, or those of the URDF kept.
    estimator : str, default="weighted"
        How coefficients are found: ``"weighted"`` (least squares, joints weighted by their noise,
        iterated), ``"ordinary"`` (all rows alike), ``"robust"`` (rows that the majority
        contradicts lose their weight), ``"ridge"`` and ``"entropic"`` (pulled toward the bodies
        of the URDF), ``"instrumental"`` (for noisy motion; fit needs instruments).
    prior_std : float or None, default=None
        How far the true bodies may be from those of the URDF, relative, for ``"ridge"`` and
        ``"entropic"``: 0.3 is 30 %. None takes what predicts left-out folds best.
    consistent : bool or BodyConstraints, default=False
        Demand bodies that can exist (positive definite pseudo-inertia), coefficients without
        forbidden signs, and what else is known about the bodies.
    forgetting : float, default=1.0
        Weight of all earlier rows at each call of ``partial_fit``; 1 forgets nothing.
    smooth : bool or None, default=None
        Derive velocity and acceleration from the positions by a zero-phase smoother. None does so
        where X has no accelerations. Needs time.
    trajectory, time : int, str or None, default="auto"
        Key columns of X; ``"auto"`` takes the columns of these names.

    Attributes
    ----------
    coef_ : ndarray of shape (n_coefficients,)
        Base parameters, then the effects' coefficients.
    coef_names_ : list of str
        Their names.
    coef_std_ : ndarray of shape (n_coefficients,)
        Standard errors by the jackknife over trajectories (or blocks of time), which
        autocorrelation within a trajectory does not fool.
    base_parameters_ : dict of str to float
        Base parameters by the combination of inertial parameters they stand for.
    inertial_parameters_ : ndarray of shape (n_bodies, 10)
        Parameters that give the same torque; what the data leaves open is as in the URDF.
    effect_terms_ : list of Term
        Effects with their shape parameters.
    effect_coefficients_ : dict of Term to ndarray
        Coefficients of every term.
    evidence_ : Evidence
        Triangular factors of [columns | torque] of every trajectory and joint; the torque is that
        beyond the URDF's rigid body.
    prior_std_ : float
        The relative uncertainty of the URDF's bodies that was used; estimators with a prior only.
    row_weights_ : list of ndarray of shape (n_rows_j,)
        Weight of every averaged row by joint, 1.25 at most; the robust estimator only.
    bands_ : PredictionBands
        What :meth:`predict_interval` knows about the errors of left-out folds.
    condition_number_ : float
        Condition number of the weighted columns of ``coef_``, scaled to equal length: how well the
        motion excites the model. Below 100 is good, beyond 1,000 a part of the coefficients is
        chance.
    noise_std_ : ndarray of shape (n_joints,)
        Standard deviation of one averaged residual row, N m or N.
    robot_ : Robot
        The robot.
    columns_ : Columns
        Which column of X means what.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Column names of X where it has them.

    See Also
    --------
    skidyn.diagnosis.diagnose : Which effect is missing.

    Notes
    -----
    :doc:`/user_guide/identification` tells when to use which estimator.

    With a time column, torque and all regressor columns are averaged over the same short windows
    (parallel filtering), without samples at rest and around reversals. Joints are weighted by their
    noise, iterated.

    References
    ----------
    M. Gautier (1997), Dynamic identification of robots with power model, ICRA, 1922-1927.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> log = make_hidden_effect_log(load_planar_arm(), None)
    >>> model = RBDRegressor(log.robot).fit(log.X, log.y)
    >>> model.predict(log.X).shape == log.y.shape
    True
    """

    def __init__(
        self,
        robot: Robot | str | os.PathLike[str],
        effects: Iterable[Any] = ("viscous", "coulomb"),
        parameters: Literal["identified", "nominal"] = "identified",
        *,
        estimator: str = "weighted",
        prior_std: float | None = None,
        consistent: bool | BodyConstraints = False,
        forgetting: float = 1.0,
        smooth: bool | None = None,
        trajectory: ColumnSpec = "auto",
        time: ColumnSpec = "auto",
    ) -> None:
        self.robot = robot
        self.effects = effects
        self.parameters = parameters
        self.estimator = estimator
        self.prior_std = prior_std
        self.consistent = consistent
        self.forgetting = forgetting
        self.smooth = smooth
        self.trajectory = trajectory
        self.time = time

    def __getstate__(self) -> dict[str, Any]:
        """State without dictionaries whose keys are objects, which skops cannot store."""
        state = dict(super().__getstate__())
        if "effect_coefficients_" in state:
            evidence = state["evidence_"]
            state["effect_coefficients_"] = list(state["effect_coefficients_"].items())
            state["evidence_"] = [
                evidence.columns,
                list(evidence.factors.items()),
                list(evidence.counts.items()),
            ]
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore what ``__getstate__`` gave."""
        state = dict(state)
        if "effect_coefficients_" in state:
            columns, factors, counts = state["evidence_"]
            state["effect_coefficients_"] = dict(state["effect_coefficients_"])
            state["evidence_"] = Evidence(columns, dict(factors), dict(counts))
        super().__setstate__(state)

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        return tags

    # ------------------------------------------------------------------ public
    def fit(self, X: Any, y: Any, instruments: Any = None) -> RBDRegressor:
        """Identify the model.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion, following the X contract.
        y : array-like of shape (n_samples, n_joints) or (n_samples,) for one joint
            Torque, N m or N.
        instruments : DataFrame or array of shape (n_samples, n_features), optional
            The columns of X along a motion whose errors have nothing to do with those of X, such
            as the reference of the controller; for ``estimator="instrumental"`` only.

        Returns
        -------
        RBDRegressor
            The model itself.

        Raises
        ------
        ColumnError
            X does not follow the contract, or y has the wrong number of joints.
        ValueError
            A parameter has no meaning, or instruments are missing, not wanted or of other rows.
        """
        method = self._method()
        if instruments is not None and self.estimator != "instrumental":
            raise ValueError(
                f"estimator={self.estimator!r} takes no instruments; 'instrumental' does"
            )
        signals, torque = self._begin(X, y, first=True)
        terms = make_terms(self.effects, self.robot_.n_joints)
        identified = self.parameters == "identified"
        plain = identified and instruments is None and not method.rows
        if signals.time is None and plain and all(map(is_linear, terms)):
            return self._fit_samples(signals, torque, terms, method)
        problem = make_problem(
            signals,
            torque,
            robot=self.robot_,
            rigid_body=identified,
            terms=terms,
            smooth=self._smooths(),
            reversals=hysteresis_joints(terms),
        )
        fit = find_terms(problem)
        whole = problem.with_base_columns()
        others = None
        if instruments is not None:
            Z = validate_data(self, instruments, reset=False, dtype=np.float64)
            others = instrument_rows(problem, fit, self._read(Z), self._smooths())
        regression = Regression.from_problem(whole if method.whole else problem, fit, others)
        self.evidence_ = Evidence.from_problem(whole, fit.terms)
        self.n_parts_ = 0
        solution = method.solve(regression, self.prior_std)
        self._store(regression, solution)
        self.bands_ = PredictionBands.calibrate(
            self, problem.signals, torque, regression, solution, partial(sample_folds, problem)
        )
        return self

    def _fit_samples(
        self, signals: Signals, torque: Array, terms: Sequence[Term], method: Estimator
    ) -> RBDRegressor:
        """Without a clock every sample is a row: their evidence says all that the rows do."""
        block, owner, fold = sample_blocks(signals.trajectory)
        parts = evidence_of_rows(signals, torque, self.robot_, terms, block)
        folds = renumbered(parts, fold)
        regression = Regression.from_evidence(folds, self.robot_, terms, whole=method.whole)
        self.evidence_ = renumbered(parts, owner)
        self.n_parts_ = 0
        solution = method.solve(regression, self.prior_std)
        self._store(regression, solution)
        self.bands_ = PredictionBands.calibrate(
            self,
            signals,
            torque,
            regression,
            solution,
            lambda rows: np.repeat(fold[block[rows], None], self.robot_.n_joints, axis=1),
        )
        return self

    @available_if(_keeps_no_rows)
    def partial_fit(self, X: Any, y: Any) -> RBDRegressor:
        """Add a part of the data, and identify the model from all parts so far.

        Only the evidence is kept, not the data: memory does not grow. The order of the parts does
        not matter, and the result is that of ``fit`` on all of them, where these are trajectories
        that are whole in one part and more than six, or data without time (``fit`` leaves out rows
        at the borders of the blocks of time into which it cuts few trajectories).

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion, following the X contract. Without a column of trajectories each part is one.
        y : array-like of shape (n_samples, n_joints) or (n_samples,) for one joint
            Torque, N m or N.

        Returns
        -------
        RBDRegressor
            The model itself.

        Raises
        ------
        ColumnError
            X does not follow the contract, or y has the wrong number of joints.
        SkidynError
            An effect with open shape parameters, or one whose columns depend on the fitted model.
            After a ``fit`` its shape parameters are kept.
        ValueError
            A parameter has no meaning.
        AttributeError
            The estimator, such as the robust one, looks at single rows, which are not kept.
        """
        self._method()
        first = not hasattr(self, "evidence_")
        signals, torque = self._begin(X, y, first=first)
        given = self.effects if first else self.effect_terms_
        terms = linear_terms(given, self.robot_.n_joints)
        part = evidence_of_signals(
            signals,
            torque,
            self.robot_,
            terms,
            rigid_body=self.parameters == "identified",
            smooth=self._smooths(),
        )
        self.n_parts_ = 1 if first else self.n_parts_ + 1
        if self.columns_.trajectory is None:
            part = part.shifted(self.n_parts_)
        if not first:
            part = self.evidence_.scaled(self.forgetting) + part
        self._store_evidence(part.shifted(0, GROUPS), terms)
        # Evidence holds no single samples, from whose errors bands are made.
        self.__dict__.pop("bands_", None)
        return self

    def predict(self, X: Any, return_std: bool = False) -> Any:
        """Torque of the model.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion. Effects with memory run along each trajectory.
        return_std : bool, default=False
            Also return the standard deviation of a measured torque from the prediction: errors of
            left-out folds, and what the spread of the coefficients makes of this motion.

        Returns
        -------
        torque : ndarray of shape (n_samples, n_joints) or (n_samples,), N m or N
            Predicted torque.
        std : ndarray of the same shape, N m or N
            If asked for.
        """
        signals = self._motion(X)
        torque = self._shaped_like_y(self._torque(signals))
        if not return_std:
            return torque
        return torque, self._shaped_like_y(find_bands(self).std(self, signals))

    def predict_interval(self, X: Any, level: float = 0.95) -> tuple[Array, Array]:
        """Band around the prediction that holds a share of the measured torques.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion.
        level : float, default=0.95
            Share of the samples, of motion and rest each, that lies in the band.

        Returns
        -------
        low, high : ndarray of shape (n_samples, n_joints) or (n_samples,), N m or N
            Borders of the band.

        Raises
        ------
        SkidynError
            The model was not fitted by ``fit``, so that no errors of left-out folds are known.
        ValueError
            ``level`` is not between 0 and 1.
        """
        signals = self._motion(X)
        half = find_bands(self).half_width(self, signals, level)
        torque = self._torque(signals)
        return self._shaped_like_y(torque - half), self._shaped_like_y(torque + half)

    def _motion(self, X: Any) -> Signals:
        check_is_fitted(self)
        X = validate_data(self, X, reset=False, dtype=np.float64)
        signals = self._read(X)
        if self._smooths():
            signals = smooth_motion(signals).signals
        return signals.with_(robot=self.robot_)

    def _shaped_like_y(self, torque: Array) -> Array:
        return torque[:, 0] if self._one_output else torque

    def _torque(self, signals: Signals) -> Array:
        """Torque of all joints; exporters call it with symbols in place of numbers."""
        torque = self.rigid_body_torque(signals.q, signals.dq, signals.ddq)
        # Effects on the transmission see the rigid body's torque; those on the sensor see the
        # model's, which includes the effects before them.
        smooth = torque.copy()
        signals = signals.with_(load=torque.copy(), inertial_parameters=self.inertial_parameters_)
        for term in self._in_order():
            state = signals
            if "model_torque" in get_effect(term.kind).needs:
                state = signals.with_(model_torque=torque.copy(), smooth_torque=smooth.copy())
            for j, block in term_columns(state, term).items():
                own = block @ self.effect_coefficients_[term]
                torque[:, j] += own
                if term.kind not in _DRY:
                    smooth[:, j] += own
        return torque

    def rigid_body_torque(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Torque of the identified rigid body alone.

        Parameters
        ----------
        q, dq, ddq : ndarray of shape (n_samples, n_joints)
            Position, velocity and acceleration, SI units.

        Returns
        -------
        ndarray of shape (n_samples, n_joints), N m or N
            Torque without the effects.
        """
        check_is_fitted(self)
        return self.robot_.inverse_dynamics(q, dq, ddq, parameters=self.inertial_parameters_)

    def with_effects(self, effects: Iterable[Any]) -> RBDRegressor:
        """An unfitted copy with more effects; those it has already are not added twice.

        Parameters
        ----------
        effects : iterable of str, (str, joints) or Term
            Effects to add.

        Returns
        -------
        RBDRegressor
            Not fitted.
        """
        more = [e for e in effects if e not in list(self.effects)]
        parameters = self.get_params(deep=False) | {"effects": [*self.effects, *more]}
        return type(self)(**parameters)

    # ------------------------------------------------------------------ hooks for tests
    def _resolve(self, n_features: int) -> Columns:
        names = getattr(self, "feature_names_in_", None)
        return resolve_columns(
            None if names is None else list(names),
            n_features,
            self.robot_.joint_names,
            trajectory=self.trajectory,
            time=self.time,
            require_acceleration=self.smooth is False,
        )

    def _check_targets(self, torque: Array) -> None:
        n = self.robot_.n_joints
        if torque.shape[1] != n:
            raise ColumnError(
                f"y has {torque.shape[1]} column(s); the robot has {n} joints "
                f"({', '.join(self.robot_.joint_names)})"
            )

    # ------------------------------------------------------------------ reading
    def _method(self) -> Estimator:
        """The estimator; parameters without a meaning are refused."""
        if self.parameters not in ("identified", "nominal"):
            raise ValueError(f"parameters={self.parameters!r}; expected 'identified' or 'nominal'")
        if not 0 < self.forgetting <= 1:
            raise ValueError(f"forgetting={self.forgetting!r}; expected a weight above 0, up to 1")
        if self.prior_std is not None and not self.prior_std > 0:
            raise ValueError(f"prior_std={self.prior_std!r}; expected a number above 0, or None")
        return find_estimator(self.estimator)

    def _begin(self, X: Any, y: Any, first: bool) -> tuple[Signals, Array]:
        """Motion and torque of validated data."""
        X, y = validate_data(
            self, X, y, reset=first, multi_output=True, y_numeric=True, dtype=np.float64
        )
        if first:
            self._one_output = y.ndim == 1
            given = self.robot
            self.robot_ = given if isinstance(given, Robot) else Robot.from_urdf(given)
            self.columns_ = self._resolve(X.shape[1])
        torque = y.reshape(len(y), -1)
        self._check_targets(torque)
        signals = self._read(X)
        for note in broken_notes(signals, torque, self.robot_.joint_names):
            warn_about_log(note)
        return signals, torque

    def _smooths(self) -> bool:
        if self.smooth is not None:
            return self.smooth
        return self.columns_.ddq is None

    def _read(self, X: Array) -> Signals:
        columns = self.columns_
        if columns.ddq is None:
            if columns.time is None:
                raise ColumnError(
                    "X has neither accelerations nor time to derive them from; add ddq1.. or time"
                )
            # Placeholders: the smoother replaces them.
            columns = Columns(
                columns.q,
                columns.dq,
                columns.dq,
                columns.trajectory,
                columns.time,
                columns.temperature,
            )
        return signals_from(X, columns, self.robot_)

    # ------------------------------------------------------------------ fitting
    def _store_evidence(self, evidence: Evidence, terms: Sequence[Term]) -> None:
        """Identify from evidence alone."""
        method = self._method()
        regression = Regression.from_evidence(evidence, self.robot_, terms, whole=method.whole)
        self.evidence_ = evidence
        self._store(regression, method.solve(regression, self.prior_std))

    def _store(self, regression: Regression, solution: Solution) -> None:
        robot, n_rigid = self.robot_, regression.n_rigid
        base = find_base_parameters(robot)
        effects = solution.coefficients[n_rigid:]
        parameters = solution.parameters
        if parameters is None:
            change = np.zeros(10 * robot.n_bodies)
            change[regression.rigid_index] = solution.coefficients[:n_rigid]
            parameters = robot.inertial_parameters + change.reshape(-1, 10)
        self.effect_terms_ = list(regression.terms)
        if self.consistent:
            parameters, effects = self._consistent(parameters, effects, solution)
        self.inertial_parameters_ = parameters
        self.effect_coefficients_ = {}
        names, at = [], 0
        for term in regression.terms:
            effect = get_effect(term.kind)
            k = len(effect.coefficients)
            self.effect_coefficients_[term] = effects[at : at + k]
            joints = ",".join(str(j + 1) for j in term.joints)
            names += [f"{term.kind}.{c.name}[{joints}]" for c in effect.coefficients]
            at += k
        values = base.values(parameters)
        self.base_parameters_ = dict(zip(base.expressions, map(float, values), strict=True))
        where = np.searchsorted(base.index, regression.rigid_index)
        self.coef_names_ = [base.expressions[i] for i in where] + names
        self.coef_ = np.r_[values[where], effects]
        self.coef_std_ = solution.std
        self.noise_std_ = solution.noise
        shown = np.r_[where, np.arange(len(base.index), len(self.evidence_.columns))]
        if self.parameters == "nominal":
            shown = np.arange(len(self.evidence_.columns))
        self.condition_number_ = condition_number(self._weighted_rows()[:, shown])
        for name, value in solution.attributes.items():
            setattr(self, name, value)

    def _in_order(self) -> list[Term]:
        """Terms, those that look at the model's torque last."""
        return sorted(self.effect_terms_, key=needs_model)


_DRY = ("coulomb", "stribeck", "offset")
