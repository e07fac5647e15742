# SPDX-License-Identifier: BSD-3-Clause
"""The loop: compare a model with measurements, see where it fails, learn what to add, add it."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone
from threadpoolctl import threadpool_limits

from skidyn._columns import ColumnSpec, column_names, resolve_columns
from skidyn._exceptions import ColumnError, LogError, LogWarning
from skidyn._signals import Array, Signals
from skidyn.diagnosis._correction import CorrectedRegressor
from skidyn.diagnosis._data_checks import suspicions
from skidyn.diagnosis._failures import REGIMES, Comparison, Failure, error_map, find_failures
from skidyn.diagnosis._findings import (
    Finding,
    effect_curves,
    make_finding,
    q_values,
    rivals_of,
)
from skidyn.diagnosis._floor import predictable_share
from skidyn.diagnosis._held_out import HeldOut, held_out_residual
from skidyn.diagnosis._intervals import parameter_intervals
from skidyn.diagnosis._limits import Limit, find_limits
from skidyn.diagnosis._reversals import look_at_reversals
from skidyn.diagnosis._search import UNKNOWN, SearchResult, Settings, replace_torque, search
from skidyn.effects import Term, list_effects, make_terms
from skidyn.evidence._problem import Problem, make_problem
from skidyn.robots import Robot

Verdict = Literal["complete", "missing", "unknown"]


@dataclass
class Diagnosis:
    """What a model lacks, where it shows, and what adding it does.

    Made by :func:`diagnose`.

    Parameters
    ----------
    verdict : {"complete", "missing", "unknown"}
        Nothing significant is missing; a named effect is missing; something is missing that no
        named effect explains.
    joint_names : tuple of str
        Names of the joints.
    findings : list of Finding
        Missing effects in the order they were added.
    comparison : Comparison
        Measured against predicted torque of the model as given, held out.
    comparison_after : Comparison
        The same with the findings added.
    history : list of dict
        ``{"added", "joints", "rmse"}`` of every step; errors per joint, held out, N m or N.
    noise_floor : ndarray of shape (n_joints,)
        Error that no smooth function of the motion could remove, N m or N.
    unexplained : dict or None
        Joints, variables and share of what stays predictable without a name.
    limits : list of Limit
        Largest magnitude of every effect that was not found.
    warnings : list of str
        What about the data or the folds the reader should know.
    base_model : regressor
        The model as given.
    data : tuple
        X and the torque it was diagnosed on.
    problem : Problem
        Averaged rows and folds behind the diagnosis.
    result : SearchResult
        Every step of the search with its ranking.
    predictable : ndarray of shape (n_joints,)
        Share of the remaining squared error that a flexible learner predicts.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.rigid_body import RBDRegressor
    >>> log = make_hidden_effect_log(load_planar_arm(), None)
    >>> diagnose(RBDRegressor(log.robot), log.X, log.y).verdict
    'complete'
    """

    verdict: Verdict
    joint_names: tuple[str, ...]
    findings: list[Finding]
    comparison: Comparison
    comparison_after: Comparison
    history: list[dict[str, Any]]
    noise_floor: Array
    unexplained: dict[str, Any] | None
    limits: list[Limit]
    warnings: list[str]
    base_model: Any = field(repr=False)
    data: tuple[Any, Any] = field(repr=False)
    problem: Problem = field(repr=False)
    result: SearchResult = field(repr=False)
    predictable: Array = field(repr=False, default_factory=lambda: np.zeros(0))

    @property
    def rmse_before(self) -> Array:
        """Held-out error of the model as given on the samples judged, (n_joints,), N m or N."""
        return np.array(self.history[0]["rmse"])

    @property
    def rmse_after(self) -> Array:
        """Held-out error with all findings added on the samples judged, (n_joints,), N m or N."""
        return np.array(self.history[-1]["rmse"])

    @cached_property
    def failures(self) -> list[Failure]:
        """Regimes in which the error of the given model stands out."""
        return find_failures(self.comparison)

    @property
    def regimes(self) -> tuple[str, ...]:
        """Names of the columns of :meth:`error_map`."""
        return REGIMES

    def error_map(self, after: bool = False) -> Array:
        """Error by joint and regime.

        Parameters
        ----------
        after : bool, default=False
            With the findings added.

        Returns
        -------
        ndarray of shape (n_joints, n_regimes), N m or N
            NaN where a regime does not occur.
        """
        return error_map(self.comparison_after if after else self.comparison)

    @property
    def budget(self) -> list[dict[str, float]]:
        """Share of each joint's squared error by cause: findings, unexplained, noise."""
        table = []
        for j in range(len(self.joint_names)):
            first = max(self.history[0]["rmse"][j] ** 2, 1e-300)
            shares: dict[str, float] = {}
            for before, after in zip(self.history[:-1], self.history[1:], strict=True):
                drop = (before["rmse"][j] ** 2 - after["rmse"][j] ** 2) / first
                shares[after["added"]] = shares.get(after["added"], 0.0) + float(drop)
            last = self.history[-1]["rmse"][j] ** 2 / first
            floor = float(self.noise_floor[j] ** 2 / first)
            shares["unexplained"] = float(max(last - floor, 0.0))
            shares["noise"] = floor
            table.append(shares)
        return table

    @cached_property
    def model(self) -> Any:
        """The given model with every finding added, fitted to all data."""
        return self._refitted([t for f in self.findings for t in f.terms])

    def add(self, kind: str, joints: Sequence[int] | None = None) -> Any:
        """Add an effect to the model and fit it again.

        Parameters
        ----------
        kind : str
            Kind of the catalogue, or ``"unknown"`` for the nameless function that was found.
        joints : sequence of int, optional
            Joints, counted from 1; by default those of the finding of this kind, or all joints.

        Returns
        -------
        RBDRegressor
            Fitted to all data.

        Raises
        ------
        EffectError
            Unknown kind, or a joint that the robot lacks.
        """
        wanted = None if joints is None else {int(j) - 1 for j in joints}
        for finding in self.findings:
            if finding.kind != kind:
                continue
            terms = [
                t
                for t in finding.terms
                if wanted is None or len(t.joints) > 1 or set(t.joints) <= wanted
            ]
            known = {j for t in terms for j in t.joints}
            if terms and (wanted is None or wanted <= known):
                return self._refitted(terms)
        spec: Any = kind if joints is None else (kind, list(joints))
        return self._refitted(make_terms([spec], len(self.joint_names)))

    def _refitted(self, terms: Sequence[Term]) -> Any:
        model = self.base_model
        if not hasattr(model, "with_effects"):
            assert self.problem.robot is not None
            model = CorrectedRegressor(model, self.problem.robot)
        return model.with_effects(terms).fit(*self.data)

    def to_dict(self) -> dict[str, Any]:
        """As the report file of ``skidyn diagnose``.

        Returns
        -------
        dict
            Following the schema ``skidyn.diagnosis/1``; provenance is added by the report.
        """
        return {
            "schema": "skidyn.diagnosis/1",
            "verdict": self.verdict,
            "joints": list(self.joint_names),
            "rmse_before": [float(x) for x in self.rmse_before],
            "rmse_after": [float(x) for x in self.rmse_after],
            "noise_floor": [float(x) for x in self.noise_floor],
            "effects": [finding.to_dict() for finding in self.findings],
            "unexplained": self.unexplained,
            "limits": [limit.to_dict() for limit in self.limits],
            "history": self.history,
            "warnings": list(self.warnings),
        }


def diagnose(
    model: Any,
    X: Any,
    tau: Any,
    *,
    robot: Robot | None = None,
    effects: Iterable[str] | None = None,
    trajectory: ColumnSpec = "auto",
    time: ColumnSpec = "auto",
    rate: float | None = None,
    smooth: bool = True,
    settings: Settings | None = None,
) -> Diagnosis:
    """Compare a model with measurements and learn which physical effects it lacks.

    Parameters
    ----------
    model : RBDRegressor or fitted regressor
        The model to be judged. An :class:`~skidyn.rigid_body.RBDRegressor` is refitted together
        with every candidate effect, fold by fold; any other fitted regressor is taken as it is and
        its residual is diagnosed.
    X : DataFrame or array of shape (n_samples, n_features)
        Motion, following the X contract; ``time`` and ``trajectory`` columns are wanted.
    tau : array-like of shape (n_samples, n_joints)
        Measured torque, N m (N for sliders).
    robot : Robot, optional
        Needed for regressors that have none of their own.
    effects : iterable of str, optional
        Kinds to try; by default the whole catalogue.
    trajectory, time : int, str or None, default="auto"
        Key columns of X; those of ``model`` if it has them.
    rate : float, Hz, optional
        Sampling rate where X has no time.
    smooth : bool, default=True
        Derive velocity and acceleration from the positions by a zero-phase smoother; False takes
        those of X.
    settings : Settings, optional
        Thresholds of the search.

    Returns
    -------
    Diagnosis
        Findings, failures, limits and the better model.

    Raises
    ------
    ColumnError
        X does not follow the contract, or holds no time and no ``rate`` is given.
    LogError
        X or the torque hold values that are not finite, or too few samples.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.rigid_body import RBDRegressor
    >>> log = make_hidden_effect_log(load_planar_arm(), "stribeck", joints=[2])
    >>> diagnosis = diagnose(RBDRegressor(log.robot), log.X, log.y)
    >>> [(finding.kind, finding.joints) for finding in diagnosis.findings]
    [('stribeck', (2,))]
    """
    with threadpool_limits(1):  # many small matrices: more threads only wait for each other
        return _diagnose(
            model, X, tau, robot, effects, trajectory, time, rate, smooth, settings or Settings()
        )


def _diagnose(
    model: Any,
    X: Any,
    tau: Any,
    robot: Robot | None,
    effects: Iterable[str] | None,
    trajectory: ColumnSpec,
    time: ColumnSpec,
    rate: float | None,
    smooth: bool,
    settings: Settings,
) -> Diagnosis:
    robot = robot if robot is not None else getattr(model, "robot", None)
    if robot is None:
        raise ColumnError("this regressor has no robot; pass robot=Robot.from_urdf(...)")
    if not isinstance(robot, Robot):
        robot = Robot.from_urdf(robot)
    signals, torque = read_signals(
        X,
        tau,
        robot,
        trajectory=getattr(model, "trajectory", trajectory) if trajectory == "auto" else trajectory,
        time=getattr(model, "time", time) if time == "auto" else time,
        rate=rate,
    )
    kinds = list_effects() if effects is None else list(effects)
    notes = suspicions(signals, torque, robot)
    for note in notes:
        warnings.warn(note, LogWarning, stacklevel=4)
    own = _is_rigid_body_regressor(model)
    if own:
        problem = make_problem(
            signals,
            torque,
            robot=robot,
            rigid_body=getattr(model, "parameters", "identified") == "identified",
            terms=_own_terms(model, robot, X, tau),
            smooth=smooth,
        )
    else:
        residual = torque - _prediction(model, X, torque)
        problem = _residual_problem(signals, residual, robot, smooth, settings)
    _check_rows(problem)
    result = search(problem, kinds, settings)
    wider, completed = look_at_reversals(problem, result, kinds, settings)
    limits = _limits(problem, result, completed, settings)
    sliding = problem.rows.sliding
    return _conclude(wider, completed, limits, sliding, torque, notes, model, (X, tau))


def _limits(
    problem: Problem, result: SearchResult, completed: SearchResult, settings: Settings
) -> list[Limit]:
    """What could still hide beside everything that was found, among the sliding samples."""
    found = [c.term for h in completed.findings for c in h.candidates]
    blocks = [problem.term_rows(t) for t in (*problem.terms, *found)]
    return find_limits(
        problem,
        result.candidates,
        blocks,
        result.fit.noise,
        result.inflation,
        settings.least_gain,
    )


def read_signals(
    X: Any,
    tau: Any,
    robot: Robot,
    *,
    trajectory: ColumnSpec = "auto",
    time: ColumnSpec = "auto",
    rate: float | None = None,
) -> tuple[Signals, Array]:
    """Signals and torque of a table that follows the X contract.

    Parameters
    ----------
    X : DataFrame or array of shape (n_samples, n_features)
        Motion.
    tau : array-like of shape (n_samples, n_joints)
        Torque, N m or N.
    robot : Robot
        Robot.
    trajectory, time : int, str or None, default="auto"
        Key columns of X.
    rate : float, Hz, optional
        Sampling rate where X has no time.

    Returns
    -------
    signals : Signals
    torque : ndarray of shape (n_samples, n_joints)
    """
    names = column_names(X)
    values = np.asarray(X.to_numpy() if hasattr(X, "to_numpy") else X)
    torque = np.asarray(tau.to_numpy() if hasattr(tau, "to_numpy") else tau, dtype=float)
    torque = torque.reshape(len(torque), -1)
    columns = resolve_columns(
        names,
        values.shape[1],
        robot.joint_names,
        trajectory=trajectory,
        time=time,
        require_acceleration=names is None,
    )
    if torque.shape != (len(values), columns.n_joints):
        raise LogError(
            f"the torque has shape {torque.shape}; {len(values)} samples of {columns.n_joints} "
            f"joints ({', '.join(robot.joint_names)}) are expected"
        )

    def pick(index: tuple[int, ...] | int) -> Array:
        chosen = list(index) if isinstance(index, tuple) else index
        return np.asarray(values[:, chosen], dtype=float)

    signals = Signals(
        pick(columns.q),
        pick(columns.dq),
        np.zeros((len(values), columns.n_joints)) if columns.ddq is None else pick(columns.ddq),
        np.zeros(len(values), dtype=np.int64)
        if columns.trajectory is None
        else pick(columns.trajectory).astype(np.int64),
        None if columns.time is None else pick(columns.time),
        None if columns.temperature is None else pick(columns.temperature),
        np.array([kind == "prismatic" for kind in robot.joint_types]),
        robot,
    )
    if signals.time is None:
        if rate is None:
            raise ColumnError(
                "X has no time column; name it by time=..., or give the sampling rate by rate=..."
            )
        signals = signals.with_(time=np.arange(len(values)) / rate)
    _check_finite(signals, torque, robot)
    return signals, torque


def _check_finite(signals: Signals, torque: Array, robot: Robot) -> None:
    for name, block in (("q", signals.q), ("dq", signals.dq), ("tau", torque)):
        bad = ~np.isfinite(block)
        if bad.any():
            row, joint = map(int, np.argwhere(bad)[0])
            raise LogError(
                f"{name} of joint {joint + 1} ({robot.joint_names[joint]}) is not finite in row "
                f"{row} ({int(bad.any(1).sum())} such rows); drop or repair them first"
            )


def _check_rows(problem: Problem) -> None:
    empty = [j + 1 for j, n in enumerate(problem.rows.counts) if n < 8]
    if len(empty) == problem.n_joints:
        raise LogError(
            "no joint slides long enough for a diagnosis: the log is too short, or all joints rest"
        )


def _is_rigid_body_regressor(model: Any) -> bool:
    return hasattr(model, "with_effects") and hasattr(model, "effects")


def _residual_problem(
    signals: Signals, residual: Array, robot: Robot, smooth: bool, settings: Settings
) -> Problem:
    """Problem of a residual that some fitted model has left.

    A fitted model has bent toward the effect it lacks, so its rigid body is free to move back; so
    is its viscous and Coulomb friction, unless just that is missing.
    """

    def problem(terms: Sequence[Term]) -> Problem:
        return make_problem(
            signals,
            residual,
            robot=robot,
            rigid_body=True,
            terms=terms,
            smooth=smooth,
            subtract_urdf=False,
        )

    friction = ["viscous", "coulomb"]
    bare = problem(())
    _check_rows(bare)
    if search(bare, friction, settings).findings:
        return problem(())
    return problem(make_terms(friction, robot.n_joints))


def _own_terms(model: Any, robot: Robot, X: Any, tau: Any) -> list[Term]:
    """Terms of the user's model, shape parameters as the model fits them."""
    terms = make_terms(model.effects, robot.n_joints)
    from skidyn.effects import get_effect

    if all(not get_effect(t.kind).shapes or t.shape for t in terms):
        return terms
    fitted = model if hasattr(model, "effect_terms_") else clone(model).fit(X, tau)
    return list(fitted.effect_terms_)


def _prediction(model: Any, X: Any, torque: Array) -> Array:
    prediction = np.asarray(model.predict(X), dtype=float).reshape(len(torque), -1)
    if prediction.shape != torque.shape:
        raise LogError(
            f"the regressor predicts shape {prediction.shape}, the torque has {torque.shape}"
        )
    return prediction


def _conclude(
    problem: Problem,
    result: SearchResult,
    limits: list[Limit],
    sliding: NDArray[np.bool_],
    torque: Array,
    notes: list[str],
    model: Any,
    data: tuple[Any, Any],
) -> Diagnosis:
    robot = problem.robot
    assert robot is not None
    base = held_out_residual(problem, problem.terms, result.fit.sigma)
    comparisons = [_comparison(problem, torque, base, sliding)]
    history = [_entry(comparisons[0], None, ())]
    terms = list(problem.terms)
    held = base
    for hypothesis in result.findings:
        terms += [c.term for c in hypothesis.candidates if c.term not in terms]
        last = hypothesis is result.findings[-1]
        held = _held_out(problem, terms, result, keep=terms[len(problem.terms) :] if last else ())
        comparisons.append(_comparison(problem, torque, held, sliding))
        history.append(_entry(comparisons[-1], hypothesis.kind, hypothesis.joints))
    intervals = parameter_intervals(problem, terms, result.fit.noise)
    q = q_values(result.findings, result.inflation, max(1, len(result.candidates)))
    rivals = {id(s.added): rivals_of(s) for s in result.steps if s.added is not None}
    findings = []
    for i, hypothesis in enumerate(result.findings):
        drop = _drop(history[i]["rmse"], history[i + 1]["rmse"], hypothesis.joints)
        finding = make_finding(problem, hypothesis, rivals[id(hypothesis)], q[i], drop, intervals)
        finding.curves.extend(effect_curves(problem, finding.terms, held.torque, held.residual))
        findings.append(finding)
    share = predictable_share(problem, result.fit.residual)
    floor = np.array(history[-1]["rmse"]) * np.sqrt(1 - share)
    return Diagnosis(
        _verdict(findings),
        robot.joint_names,
        findings,
        comparisons[0],
        comparisons[-1],
        history,
        floor,
        _unexplained(findings),
        limits,
        notes + _fold_notes(problem),
        model,
        data,
        problem,
        result,
        share,
    )


def _held_out(
    problem: Problem, terms: Sequence[Term], result: SearchResult, keep: Sequence[Term]
) -> HeldOut:
    """Held-out residual; a ripple's coefficients come from the residual at the full rate."""
    waves = [t for t in terms if t.kind == "torque_ripple"]
    rest = [t for t in terms if t.kind != "torque_ripple"]
    if not waves:
        return held_out_residual(problem, rest, result.fit.sigma, keep)
    torque = problem.torque - result.ripple
    held = held_out_residual(replace_torque(problem, torque), rest, result.fit.sigma, keep)
    for t in waves:
        own = np.zeros_like(torque)
        own[:, t.joints[0]] = result.ripple[:, t.joints[0]]
        held.torque[t] = own
    return held


def _comparison(
    problem: Problem, torque: Array, held: HeldOut, sliding: NDArray[np.bool_]
) -> Comparison:
    assert problem.robot is not None
    return Comparison(
        problem.signals,
        torque,
        torque - held.residual,
        sliding,
        problem.robot.joint_names,
        problem.rows.sliding,
    )


def _entry(comparison: Comparison, added: str | None, joints: Sequence[int]) -> dict[str, Any]:
    rmse = [float(x) for x in comparison.rmse(judged=True)]
    return {"added": added, "joints": [j + 1 for j in joints], "rmse": rmse}


def _drop(before: Sequence[float], after: Sequence[float], joints: Sequence[int]) -> float:
    """Share of the squared error removed, on the joints of the effect, each in its own unit."""
    pairs = [(before[j], after[j]) for j in joints if before[j] > 0]
    if not pairs:
        return 0.0
    return float(np.mean([1 - (a / b) ** 2 for b, a in pairs]))


def _verdict(findings: Sequence[Finding]) -> Verdict:
    if not findings:
        return "complete"
    return "unknown" if any(f.kind == UNKNOWN for f in findings) else "missing"


def _unexplained(findings: Sequence[Finding]) -> dict[str, Any] | None:
    for finding in findings:
        if finding.kind == UNKNOWN:
            return {
                "joints": list(finding.joints),
                "variables": list(finding.variables),
                "share": finding.error_drop,
            }
    return None


def _fold_notes(problem: Problem) -> list[str]:
    if problem.whole_trajectories:
        return []
    names = np.unique(problem.signals.trajectory)
    count = "one trajectory" if len(names) == 1 else f"{len(names)} trajectories"
    return [
        f"The log has only {count}: errors are held out by {problem.n_folds} blocks of time with "
        "a guard between them, not by whole trajectories, and may flatter the model."
    ]
