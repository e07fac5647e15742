# SPDX-License-Identifier: BSD-3-Clause
"""Rigid-body dynamics with physical effects, identified from data, as a scikit-learn regressor."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from copy import copy
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.utils.metaestimators import available_if

from skidyn._checks import warn_about_log
from skidyn._columns import ColumnSpec
from skidyn._exceptions import EffectError
from skidyn._signals import Array, Signals
from skidyn._validation import validate_motion
from skidyn.effects import Term, TermSum, make_terms
from skidyn.evidence import (
    Evidence,
    Fit,
    Problem,
    evidence_of_rows,
    evidence_of_signals,
    hysteresis_joints,
    independent_columns,
    linear_terms,
    make_problem,
    renumbered,
    sample_blocks,
    smooth_motion,
)
from skidyn.forward import Controller, references
from skidyn.identification._constraints import BodyConstraints
from skidyn.identification._estimators import Estimator, find_estimator
from skidyn.identification._every_sample import may_take_samples, predicts_better
from skidyn.identification._identifiability import condition_number
from skidyn.identification._instrumental import instrument_rows
from skidyn.identification._output_error import refine_by_simulation
from skidyn.identification._parameters import (
    check_data,
    check_terms,
    checked_estimator,
    checked_weight,
    in_weighted_trajectories,
    keeps_no_rows,
)
from skidyn.identification._prediction import Prediction
from skidyn.identification._recordings import remember
from skidyn.identification._regression import Regression, Solution
from skidyn.identification._results import Results
from skidyn.identification._terms import find_terms
from skidyn.identification._uncertainty import PredictionBands
from skidyn.identification._weak_directions import keep_weak_directions
from skidyn.robots import Robot, find_base_parameters

#: Number of groups of trajectories whose evidence partial_fit keeps separate, for standard errors.
GROUPS = 20


class RBDRegressor(Prediction, Results, MultiOutputMixin, RegressorMixin, BaseEstimator):
    """Inverse dynamics of a robot: rigid body and effects, identified together.

    Parameters
    ----------
    robot : Robot, str or path
        Robot, or its URDF.
    effects : sequence of str, (str, joints) or Term, default=("viscous", "coulomb")
        Effects in addition to the rigid body: ``"viscous"`` on all joints, ``("dahl", [1, 4])`` on
        some (counted from 1), or a :class:`~skidyn.effects.Term` with its shape parameters. Shape
        parameters that are not given are searched.
    parameters : {"identified", "nominal"}, default="identified"
        Whether inertial parameters are identified or kept as in the URDF.
    estimator : str, default="weighted"
        Estimator of the coefficients: ``"weighted"`` (least squares, joints weighted by their
        noise, iterated), ``"ordinary"`` (equal weights for all rows), ``"robust"`` (outlying rows
        have reduced weight), ``"ridge"`` and ``"entropic"`` (regularised toward the bodies of the
        URDF), ``"instrumental"`` (for noisy motion; fit needs instruments), ``"output_error"`` (for
        simulation: minimises the error of the simulated motion).
    prior_std : float or None, default=None
        Relative uncertainty of the bodies of the URDF for ``"ridge"`` and ``"entropic"``: 0.3 is 30
        %. None selects the value that best predicts left-out folds. The other estimators combine
        directions that the log hardly determines with the URDF; ``numpy.inf`` uses the data only,
        as in plain least squares.
    consistent : bool or BodyConstraints, default=False
        Require physically consistent bodies (positive definite pseudo-inertia), coefficients with
        admissible signs, and further constraints on the bodies.
    horizon : float or None, default=1.0
        Seconds that ``"output_error"`` simulates from each measured state; None for whole
        trajectories, which is possible only without drift.
    forgetting : float, default=1.0
        Weight of all earlier rows at each call of ``partial_fit``; 1 keeps their weight.
    smooth : bool or None, default=None
        Derive velocity and acceleration from the positions by a zero-phase smoother, whose cut-off
        follows from the noise of the positions of X. None does so if X has no accelerations.
        Requires time.
    trajectory, time : int, str or None, default="auto"
        Key columns of X; ``"auto"`` takes the columns of these names.

    Attributes
    ----------
    coef_ : ndarray of shape (n_coefficients,)
        Base parameters, then the effects' coefficients.
    coef_names_ : list of str
        Names of the coefficients.
    coef_std_ : ndarray of shape (n_coefficients,)
        Standard errors by the jackknife over trajectories (or blocks of time), which are valid
        under autocorrelation within a trajectory; for directions that the data does not determine,
        the uncertainty of the URDF.
    base_parameters_ : dict of str to float
        Base parameters by the combination of inertial parameters that they represent.
    inertial_parameters_ : ndarray of shape (n_bodies, 10)
        Parameters that give the same torque; directions that the data does not determine are as in
        the URDF.
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
        Errors of left-out folds, from which :meth:`predict_interval` computes its bands.
    condition_number_ : float
        Condition number of the weighted columns excited by the data, scaled to equal length. Below
        100 the excitation is good, beyond 1,000 some coefficients are determined by noise.
    noise_std_ : ndarray of shape (n_joints,)
        Standard deviation of one residual row, N m or N.
    rows_ : {"averaged", "samples"}
        Whether the rows of the fit are averages over short windows of motion, or all samples.
    recordings_ : list of (int, ndarray of uint64)
        Fingerprints of the recordings, by which effects of single recordings are assigned.
    robot_ : Robot
        The robot.
    columns_ : Columns
        Meaning of the columns of X.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Names of the columns, if X has names.

    See Also
    --------
    skidyn.diagnosis.diagnose : Which effect is missing.

    Notes
    -----
    :doc:`/user_guide/identification` explains when to use which estimator.

    Directions of the inertial parameters that the data hardly determines are kept as in the URDF;
    those that it determines ten times better than the URDF change by less than one part in a
    million. The uncertainty of the URDF is estimated from the data (empirical Bayes). Estimators
    with a prior use it instead.

    With a time column, torque and all regressor columns are averaged over the same short windows
    (parallel filtering), without samples at rest and around reversals. If X has accelerations and
    left-out folds are predicted better that way, every sample is a row instead, unless noise in the
    accelerations would bias the coefficients. Joints are weighted by their noise, iterated.

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

    # With metadata routing enabled, weights passed to this model are for its fit.
    __metadata_request__fit = {"sample_weight": True}
    __metadata_request__score = {"sample_weight": True}

    def __init__(
        self,
        robot: Robot | str | os.PathLike[str],
        effects: Iterable[Any] = ("viscous", "coulomb"),
        parameters: Literal["identified", "nominal"] = "identified",
        *,
        estimator: str = "weighted",
        prior_std: float | None = None,
        consistent: bool | BodyConstraints = False,
        horizon: float | None = 1.0,
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
        self.horizon = horizon
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
        """Restore the state of ``__getstate__``."""
        state = dict(state)
        if "effect_coefficients_" in state:
            columns, factors, counts = state["evidence_"]
            state["effect_coefficients_"] = dict(state["effect_coefficients_"])
            state["evidence_"] = Evidence(columns, dict(factors), dict(counts))
        super().__setstate__(state)

    def fit(
        self,
        X: Any,
        y: Any,
        sample_weight: Any = None,
        instruments: Any = None,
        controller: Controller | None = None,
    ) -> RBDRegressor:
        """Identify the model.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion, following the X contract.
        y : array-like of shape (n_samples, n_joints) or (n_samples,) for one joint
            Torque, N m or N.
        sample_weight : array-like of shape (n_samples,), default=None
            Weight of every sample. An averaged row has the mean weight of its samples; those of
            weight 0 are left out, and so are trajectories without any other weight. With a time
            column only ratios of weights count; without one, a sample of weight 2 counts as two.
        instruments : DataFrame or array of shape (n_samples, n_features), optional
            The columns of X along a motion whose errors are independent of those of X, such as the
            reference of the controller; for ``estimator="instrumental"`` only.
        controller : Controller, optional
            Drives the simulated model by the commands of X (``q_ref1..`` or ``cmd1..``, rad or m)
            instead of y; for ``estimator="output_error"`` only. For a log of a position servo, y is
            :func:`skidyn.simulation.servo_torque`, which gives the initial fit.

        Returns
        -------
        RBDRegressor
            The model itself.

        Raises
        ------
        ColumnError
            X does not follow the contract, or y has the wrong number of joints; X lacks commands.
        ValueError
            A parameter is invalid; instruments are missing, not accepted or have different rows; a
            controller is not accepted or invalid.
        """
        method = checked_estimator(self)
        check_data(self, method, instruments, controller)
        self.__dict__.pop("recordings_", None)
        signals, torque, order = self._begin(X, y, first=True)
        weight = checked_weight(sample_weight, torque, order)
        if weight is not None:
            kept = in_weighted_trajectories(signals, weight)
            signals, torque, order = signals.take(kept), torque[kept], order[kept]
            weight = weight[kept]
            if signals.time is not None:
                weight = weight / weight[weight > 0].mean()
        terms = make_terms(self.effects, self.robot_.n_joints)
        check_terms(terms, signals)
        self.recordings_ = remember(signals, terms)
        plain = self.parameters == "identified" and instruments is None and not method.rows
        needs_fit = any(t.effect.needs_fit or t.is_open for t in terms)
        if signals.time is None and plain and weight is None and not needs_fit:
            return self._fit_samples(signals, torque, terms, method)
        problem = self._problem(signals, torque, terms, weight)
        fit = find_terms(problem)
        whole = problem.with_base_columns()
        others = None
        if instruments is not None:
            Z = validate_motion(self, instruments, reset=False, dtype=np.float64)
            Z = Z[order] if len(Z) == len(X) else Z
            others = instrument_rows(problem, fit, self._read(Z), self._smooths())
        self.rows_ = "averaged"
        self.evidence_ = Evidence.from_problem(whole, fit.terms)
        self.n_parts_ = 0
        every, shown = _regressions(problem, whole, fit, others, weight)
        kept = np.searchsorted(whole.rigid_index, problem.rigid_index)
        solution = self._solve(method, every, shown, kept)
        self._store(every, solution)
        if method.simulates:
            commands = None if controller is None else references(X, self.robot_)[order]
            solution = refine_by_simulation(
                self, every, solution, problem.signals, torque, self.horizon, controller, commands
            )
            self._store(every, solution)
        joints = range(problem.n_joints)
        self.bands_ = PredictionBands.calibrate(
            self,
            problem.signals,
            torque,
            every,
            solution,
            lambda rows: np.column_stack([problem.sample_folds(j, rows) for j in joints]),
            weight,
        )
        as_given = problem.signals.time is not None and not (self._smooths() or self._broken)
        if as_given and plain and not needs_fit and may_take_samples(terms):
            other = copy(self)._fit_samples(signals, torque, terms, method, weight)
            if predicts_better(other.bands_, self.bands_):
                self.__dict__.update(other.__dict__)
        return self

    def _problem(
        self, signals: Signals, torque: Array, terms: Sequence[Term], weight: Array | None
    ) -> Problem:
        """Averaged rows; every sample is a row if the log has too few of them."""

        def made(signals: Signals, smooth: bool) -> Problem:
            return make_problem(
                signals,
                torque,
                robot=self.robot_,
                rigid_body=self.parameters == "identified",
                terms=terms,
                smooth=smooth,
                reversals=hysteresis_joints(terms),
                weight=weight,
            )

        problem = made(signals, self._smooths())
        unknowns = len(problem.rigid_index) + sum(t.width for t in terms)
        if signals.time is None or problem.rows.counts.sum() >= max(unknowns, 1):
            return problem
        warn_about_log(
            f"{signals.n_samples} samples make {int(problem.rows.counts.sum())} rows when they "
            "are averaged over short windows of motion, too few to fit a model: the log is "
            "short, scattered in time, or at rest. Every sample is used as a row instead, "
            "without treatment of noise, rest and reversals. Use a longer log of motion."
        )
        if self._smooths():
            signals = smooth_motion(signals)
        return made(signals.with_(time=None), False)

    def _solve(
        self, method: Estimator, every: Regression, shown: Regression, kept: NDArray[np.int64]
    ) -> Solution:
        """Coefficients of all base parameters, from the data or, if undetermined, from the URDF."""
        if method.whole:
            return method.solve(every, self.prior_std)
        solution = method.solve(shown, self.prior_std)
        if "row_weights_" in solution.attributes:
            every = every.weighted(solution.attributes["row_weights_"])
        return keep_weak_directions(solution, kept, every, trusted=self.prior_std != np.inf)

    def _fit_samples(
        self,
        signals: Signals,
        torque: Array,
        terms: Sequence[Term],
        method: Estimator,
        weight: Array | None = None,
    ) -> RBDRegressor:
        """Every sample is a row: their evidence contains all information of the rows."""
        block, owner, fold = sample_blocks(signals.trajectory)
        parts = evidence_of_rows(signals, torque, self.robot_, terms, block, weight=weight)
        folds = renumbered(parts, fold)
        self.rows_ = "samples"
        self.evidence_ = renumbered(parts, owner)
        self.n_parts_ = 0
        regression, solution = self._solve_evidence(method, folds, terms)
        self._store(regression, solution)
        self.bands_ = PredictionBands.calibrate(
            self,
            signals,
            torque,
            regression,
            solution,
            lambda rows: np.repeat(fold[block[rows], None], self.robot_.n_joints, axis=1),
            weight,
        )
        return self

    @available_if(keeps_no_rows)
    def partial_fit(self, X: Any, y: Any) -> RBDRegressor:
        """Add a part of the data, and identify the model from all parts so far.

        Only the evidence is kept, not the data: memory does not grow. The order of the parts does
        not matter, and the result is that of ``fit`` on all of them if there are more than six
        trajectories, each within one part, or if the data has no time. (``fit`` leaves out rows at
        the borders of the blocks of time into which it cuts few trajectories, and may use every
        sample as a row, as later parts then do as well.)

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion, following the X contract. Without a column of trajectories each part is one
            trajectory.
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
            An effect has open shape parameters, or its columns depend on the fitted model. After a
            ``fit`` its shape parameters are kept.
        ValueError
            A parameter has no meaning.
        AttributeError
            The estimator, such as the robust one, needs single rows, which are not kept.
        """
        checked_estimator(self)
        first = not hasattr(self, "evidence_")
        signals, torque, _ = self._begin(X, y, first=first)
        given = self.effects if first else self.effect_terms_
        terms = linear_terms(given, self.robot_.n_joints)
        check_terms(terms, signals)
        asked = [(t.kind, t.joints) for t in make_terms(self.effects, self.robot_.n_joints)]
        if asked != [(t.kind, t.joints) for t in terms]:
            raise EffectError(
                "the effects of the model were changed after its first part of the data, whose "
                "evidence lacks the columns of the new ones; clone the model and start again"
            )
        if first:
            self.rows_ = "averaged" if signals.time is not None else "samples"
        if self.rows_ == "samples":
            signals = signals.with_(time=None)
        part = evidence_of_signals(
            signals,
            torque,
            self.robot_,
            terms,
            rigid_body=self.parameters == "identified",
            smooth=self._smooths(),
        )
        if first:
            self.recordings_ = remember(signals, terms)
        self.n_parts_ = 1 if first else self.n_parts_ + 1
        if self.columns_.trajectory is None:
            part = part.shifted(self.n_parts_)
        if not first:
            part = self.evidence_.scaled(self.forgetting) + part
        self._store_evidence(part.shifted(0, GROUPS), terms)
        # Evidence contains no single samples, whose errors are needed for bands.
        self.__dict__.pop("bands_", None)
        return self

    def with_effects(self, effects: Iterable[Any]) -> RBDRegressor:
        """Unfitted copy with additional effects; existing effects are not added twice.

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

    def _store_evidence(self, evidence: Evidence, terms: Sequence[Term]) -> None:
        """Identify from evidence alone."""
        method = checked_estimator(self)
        regression, solution = self._solve_evidence(method, evidence, terms)
        self.evidence_ = evidence
        self._store(regression, solution)

    def _solve_evidence(
        self, method: Estimator, evidence: Evidence, terms: Sequence[Term]
    ) -> tuple[Regression, Solution]:
        every = Regression.from_evidence(evidence, self.robot_, terms, whole=True)
        shown = Regression.from_evidence(evidence, self.robot_, terms, whole=False)
        kept = np.searchsorted(every.rigid_index, shown.rigid_index)
        return every, self._solve(method, every, shown, kept)

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
        if self.consistent and not solution.consistent:
            parameters, effects = self._consistent(parameters, effects, solution)
        self.inertial_parameters_ = parameters
        self.effect_coefficients_ = {}
        terms = TermSum(regression.terms)
        for term, own in terms.slices():
            self.effect_coefficients_[term] = effects[own]
        values = base.values(parameters)
        self.base_parameters_ = dict(zip(base.expressions, map(float, values), strict=True))
        where = np.searchsorted(base.index, regression.rigid_index)
        self.coef_names_ = [*(base.expressions[i] for i in where), *terms.names]
        self.coef_ = np.r_[values[where], effects]
        self.coef_std_ = solution.std
        self.noise_std_ = solution.noise
        rows = self._weighted_rows()[:, :-1]
        shown = np.arange(rows.shape[1])
        if self.parameters == "identified" and not find_estimator(self.estimator).whole:
            # Directions that the data does not excite at all are as in the URDF, and not estimated.
            n_base = len(base.index)
            shown = np.r_[independent_columns(rows[:, :n_base]), shown[n_base:]]
        self.condition_number_ = condition_number(rows[:, shown])
        for name, value in solution.attributes.items():
            setattr(self, name, value)


def _regressions(
    problem: Problem,
    whole: Problem,
    fit: Fit,
    instruments: list[Array] | None,
    weight: Array | None,
) -> tuple[Regression, Regression]:
    """Regression of all base parameters, and of those that the data shows."""
    every = Regression.from_problem(whole, fit, instruments if whole is problem else None)
    shown = every if whole is problem else Regression.from_problem(problem, fit, instruments)
    if weight is not None:
        # Rows have a mean weight of 1; the samples have another.
        mean = float(weight[weight > 0].mean())
        every, shown = every.copied(mean), shown.copied(mean)
    return every, shown
