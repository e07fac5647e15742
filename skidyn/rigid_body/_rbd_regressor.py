# SPDX-License-Identifier: BSD-3-Clause
"""Rigid-body dynamics with physical effects, identified from data, as a scikit-learn regressor."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from skidyn._columns import Columns, ColumnSpec, resolve_columns
from skidyn._exceptions import ColumnError
from skidyn._signals import Array, Signals, signals_from
from skidyn.effects import Term, get_effect, make_terms
from skidyn.evidence._evidence import Evidence
from skidyn.evidence._folded import left_out_coefficients
from skidyn.evidence._kinematics import smooth_motion
from skidyn.evidence._problem import Fit, Problem, hysteresis_joints, make_problem, term_columns
from skidyn.evidence._shapes import Gain, best_on_grid, refine_term
from skidyn.rigid_body._base_parameters import find_base_parameters
from skidyn.rigid_body._consistency import make_consistent
from skidyn.robots import Robot

#: Rounds of weights, loads and shape parameters.
ROUNDS = 3


class RBDRegressor(RegressorMixin, BaseEstimator):
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
    consistent : bool, default=False
        Demand bodies that can exist (positive definite pseudo-inertia) and coefficients without
        forbidden signs.
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
        consistent: bool = False,
        smooth: bool | None = None,
        trajectory: ColumnSpec = "auto",
        time: ColumnSpec = "auto",
    ) -> None:
        self.robot = robot
        self.effects = effects
        self.parameters = parameters
        self.consistent = consistent
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
    def fit(self, X: Any, y: Any) -> RBDRegressor:
        """Identify the model.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion, following the X contract.
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
        ValueError
            ``parameters`` is neither ``"identified"`` nor ``"nominal"``.
        """
        if self.parameters not in ("identified", "nominal"):
            raise ValueError(f"parameters={self.parameters!r}; expected 'identified' or 'nominal'")
        X, y = validate_data(self, X, y, multi_output=True, y_numeric=True, dtype=np.float64)
        self._one_output = y.ndim == 1
        torque = y.reshape(len(y), -1)
        self.robot_ = self.robot if isinstance(self.robot, Robot) else Robot.from_urdf(self.robot)
        self.columns_ = self._resolve(X.shape[1])
        self._check_targets(torque)
        signals = self._read(X)
        terms = make_terms(self.effects, self.robot_.n_joints)
        problem = make_problem(
            signals,
            torque,
            robot=self.robot_,
            rigid_body=self.parameters == "identified",
            terms=terms,
            smooth=self._smooths(),
            reversals=hysteresis_joints(terms),
        )
        fit = self._identify(problem)
        self._store(problem, fit)
        return self

    def predict(self, X: Any) -> Array:
        """Torque of the model.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion. Effects with memory run along each trajectory.

        Returns
        -------
        ndarray of shape (n_samples, n_joints) or (n_samples,), N m or N
            Predicted torque.
        """
        check_is_fitted(self)
        X = validate_data(self, X, reset=False, dtype=np.float64)
        signals = self._read(X)
        if self._smooths():
            signals = smooth_motion(signals).signals
        torque = self._torque(signals.with_(robot=self.robot_))
        return torque[:, 0] if self._one_output else torque

    def _torque(self, signals: Signals) -> Array:
        """Torque of all joints; exporters call it with symbols in place of numbers."""
        torque = self.rigid_body_torque(signals.q, signals.dq, signals.ddq)
        # Effects on the transmission see the rigid body's torque; those on the sensor see the
        # model's, which includes the effects before them.
        smooth = torque.copy()
        load = torque.copy()
        for term in self._in_order():
            state = signals.with_(
                load=load,
                model_torque=torque.copy(),
                smooth_torque=smooth.copy(),
                inertial_parameters=self.inertial_parameters_,
            )
            own = np.zeros_like(torque)
            for j, block in term_columns(state, term).items():
                own[:, j] += block @ self.effect_coefficients_[term]
            torque += own
            if term.kind not in _DRY:
                smooth += own
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

    def parameter_table(self) -> list[dict[str, Any]]:
        """Every coefficient with its standard error.

        Returns
        -------
        list of dict
            ``name``, ``value``, ``std`` and ``relative_std`` (std over value).
        """
        check_is_fitted(self)
        rows = zip(self.coef_names_, self.coef_, self.coef_std_, strict=True)
        return [
            {
                "name": name,
                "value": float(value),
                "std": float(std),
                "relative_std": float(std / abs(value)) if value else float("inf"),
            }
            for name, value, std in rows
        ]

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
    def _identify(self, problem: Problem) -> Fit:
        """Weights, loads and shape parameters in turn, from simple to whole."""
        given = list(problem.terms)
        early = [t for t in given if not _needs_model(t) and not _to_search(t)]
        fit = problem.fit(early, passes=2)
        terms = early
        for round_ in range(ROUNDS):
            problem.with_fit(fit)
            terms = self._shaped(problem, given if round_ == 0 else terms, fit)
            fit = problem.fit(terms, sigma=fit.noise, passes=2)
            if not any(_needs_model(t) or get_effect(t.kind).shapes for t in terms):
                break
        return fit

    def _shaped(self, problem: Problem, terms: Sequence[Term], fit: Fit) -> list[Term]:
        """Terms with the shape parameters that were left open found and refined."""
        shaped = list(terms)
        open_ = [i for i, t in enumerate(terms) if t in fit.terms or not _to_search(t)]
        for i, term in enumerate(terms):
            if not _to_search(term):
                continue
            others = [problem.term_rows(shaped[k]) for k in open_ if k != i]
            gain = Gain(problem, others, fit.noise, problem.target)
            start = best_on_grid(problem, term.kind, term.joints, gain)
            shaped[i] = refine_term(problem, start, gain)
            open_.append(i)
        return shaped

    def _store(self, problem: Problem, fit: Fit) -> None:
        n_rigid = len(problem.rigid_index)
        coefficients = fit.coefficients
        parameters = problem.inertial_parameters(fit)
        assert parameters is not None
        if self.consistent:
            parameters, effects = self._consistent(problem, fit)
            coefficients = np.r_[coefficients[:n_rigid], effects]
        self.inertial_parameters_ = parameters
        self.effect_terms_ = list(fit.terms)
        self.effect_coefficients_ = {}
        names, at = [], n_rigid
        for term in fit.terms:
            effect = get_effect(term.kind)
            k = len(effect.coefficients)
            self.effect_coefficients_[term] = coefficients[at : at + k]
            joints = ",".join(str(j + 1) for j in term.joints)
            names += [f"{term.kind}.{c.name}[{joints}]" for c in effect.coefficients]
            at += k
        base = find_base_parameters(self.robot_)
        values = base.values(parameters)
        self.base_parameters_ = dict(zip(base.expressions, map(float, values), strict=True))
        where = np.searchsorted(base.index, problem.rigid_index)
        self.coef_names_ = [base.expressions[i] for i in where] + names
        self.coef_ = np.r_[values[where], coefficients[n_rigid:]]
        self.coef_std_ = _jackknife(problem, fit)
        self.noise_std_ = fit.noise
        self.evidence_ = Evidence.from_problem(problem, fit.terms)

    def _consistent(self, problem: Problem, fit: Fit) -> tuple[Array, Array]:
        """Bodies that can exist and coefficients of the right sign, closest to the data."""
        whole = problem.with_all_rigid_columns()
        design = whole.design([whole.term_rows(t) for t in fit.terms])
        nominal = self.robot_.inertial_parameters
        n = nominal.size if self.parameters == "identified" else 0
        a = np.vstack([block / s for block, s in zip(design, fit.noise, strict=True)])
        y = np.concatenate([t / s for t, s in zip(whole.target, fit.noise, strict=True)])
        signs = np.concatenate(
            [[c.sign for c in get_effect(t.kind).coefficients] for t in fit.terms] or [[]]
        )
        start = fit.coefficients[len(problem.rigid_index) :]
        if n == 0:
            from scipy.optimize import lsq_linear

            low = np.where(signs > 0, 0.0, -np.inf)
            return nominal, lsq_linear(a, y, (low, np.inf)).x if len(signs) else start
        # The columns act on the change from the URDF's parameters.
        measured = y + a[:, :n] @ nominal.ravel()
        factor: Array = np.asarray(np.linalg.qr(np.column_stack([a, measured]), mode="r"))
        return make_consistent(nominal, factor[:, :-1], factor[:, -1], signs, start)

    def _in_order(self) -> list[Term]:
        """Terms, those that look at the model's torque last."""
        return sorted(self.effect_terms_, key=_needs_model)


_DRY = ("coulomb", "stribeck", "offset")


def _needs_model(term: Term) -> bool:
    return bool({"load", "model_torque"} & set(get_effect(term.kind).needs))


def _to_search(term: Term) -> bool:
    """Whether shape parameters of a term were left open."""
    effect = get_effect(term.kind)
    if effect.search != "grid" or term.shape:
        return False
    return bool(effect.shapes) or type(effect).grid is not _plain_grid()


def _plain_grid() -> Any:
    from skidyn.effects import Effect

    return Effect.grid


def _jackknife(problem: Problem, fit: Fit) -> NDArray[np.float64]:
    """Standard errors from leaving out one fold at a time (Efron, Stein 1981)."""
    design = problem.design([problem.term_rows(t) for t in fit.terms])
    _, left = left_out_coefficients(problem, design, fit.noise, problem.target)
    n = len(left)
    spread = np.sum((left - left.mean(0)) ** 2, axis=0)
    return np.asarray(np.sqrt((n - 1) / n * spread))
