# SPDX-License-Identifier: BSD-3-Clause
"""The loop: compare a model with measurements, find where it fails, identify missing effects."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from sklearn.base import clone
from sklearn.utils.validation import _check_sample_weight
from threadpoolctl import threadpool_limits

from skidyn._columns import ColumnSpec
from skidyn._cores import alone, aside, cores
from skidyn._exceptions import ColumnError, EffectError, LogError, LogWarning, SkidynError
from skidyn._memory import give_back
from skidyn._order import refuse_shuffled
from skidyn._signals import Array, Signals, read_signals
from skidyn.diagnosis._beginnings import look_after_beginnings
from skidyn.diagnosis._blocks import block_length, time_blocks, variance_inflation
from skidyn.diagnosis._conclusion import conclude
from skidyn.diagnosis._confidence import in_doubt
from skidyn.diagnosis._correction import is_physics, open_model
from skidyn.diagnosis._findings import Finding
from skidyn.diagnosis._hypothesis import SearchResult
from skidyn.diagnosis._limits import Gates, Limit, find_limits, without_withdrawn
from skidyn.diagnosis._result import Diagnosis
from skidyn.diagnosis._reversals import look_at_reversals
from skidyn.diagnosis._rule import Settings
from skidyn.diagnosis._search import search
from skidyn.diagnosis._servo_settings import (
    Servos,
    settings_found,
    split_kinds,
    with_settings,
)
from skidyn.diagnosis._swift import look_at_swift
from skidyn.effects import Term, get_effect, make_terms, searched_kinds
from skidyn.evidence import Fit, Problem, make_problem
from skidyn.measurement import (
    Measurement,
    Suspicion,
    check_measurement,
    copied_rows,
    names_in_doubt,
    refuse_certain,
)
from skidyn.robots import Robot
from skidyn.simulation import Controller

#: Suspicions with which a wave in time may be due to the logger. Uneven steps that are only noted
#: are those of the samples, or too small to matter.
UNSTEADY = {"repeated_rows", "interpolated_rows", "clock_jitter"}


def diagnose(
    model: Any,
    X: Any,
    tau: Any = None,
    *,
    controller: Controller | None = None,
    robot: Robot | None = None,
    effects: Iterable[str] | None = None,
    trajectory: ColumnSpec = "auto",
    time: ColumnSpec = "auto",
    rate: float | None = None,
    smooth: bool = True,
    settings: Settings | None = None,
    force: bool = False,
    sample_weight: Any = None,
    n_jobs: int | None = None,
    checks: Sequence[Suspicion] | None = None,
) -> Diagnosis:
    """Compare a model with measurements and find the physical effects that it lacks.

    Parameters
    ----------
    model : RBDRegressor or fitted regressor
        The model to be judged. An :class:`~skidyn.identification.RBDRegressor` is refitted together
        with every candidate effect, fold by fold; for any other fitted regressor the residual is
        diagnosed without refitting. A model of the first kind is extracted from a search, a
        ``TransformedTargetRegressor``, or a ``Pipeline``. For a ``Pipeline`` the completed model is
        a ``Pipeline``.
    X : DataFrame or array of shape (n_samples, n_features)
        Motion, following the X contract, with ``time`` and ``trajectory`` where they are known.
    tau : array-like of shape (n_samples, n_joints), optional
        Measured torque, N m (N for sliders); may be left out with a controller.
    controller : Controller, optional
        Position servos from whose commands in X (``q_ref1..`` or ``cmd1..``) the torque is computed
        where ``tau`` is None (:func:`skidyn.simulation.servo_torque`). In this case checks of the
        torque sensor are omitted, and a known limit of all servos is not an effect. Settings of the
        servos that differ from the stated ones are the first findings, and the others are judged
        by the torque of the servos with these settings.
    robot : Robot, optional
        Robot; needed for regressors without one.
    effects : iterable of str, optional
        Kinds to try; by default the whole catalogue.
    trajectory, time : int, str or None, default="auto"
        Key columns of X; those of ``model`` if it has them.
    rate : float, Hz, optional
        Sampling rate if X has no time.
    smooth : bool, default=True
        Derive velocity and acceleration from the positions by a zero-phase smoother; if False, use
        those of X.
    settings : Settings, optional
        Thresholds of the search.
    force : bool, default=False
        Continue although a check is certain of an error in the log
        (:func:`skidyn.measurement.check_measurement`).
    sample_weight : array-like of shape (n_samples,), optional
        Weight of every sample in all fits; those of weight 0 are left out.
    n_jobs : int, optional
        Processes, as joblib counts them: None is 1 unless set by a ``joblib.parallel_config``, -1
        is all cores. The result does not depend on it. On systems other than Linux there is one
        process.
    checks : sequence of Suspicion, optional
        Known suspicions about this log: the ``checks`` of an earlier diagnosis of it. By default
        the log is checked, which takes a third of the time.

    Returns
    -------
    Diagnosis
        Findings, failures, limits and the better model.

    Raises
    ------
    ColumnError
        X does not follow the contract, or has no time and no ``rate`` is given.
    LogError
        X or the torque contain values that are not finite, or too few samples; or a check is
        certain that the log is wrong, and ``force`` is False.
    EffectError
        The catalogue has no such effect.
    ValueError
        ``model`` is no regressor, ``settings``, ``smooth`` or ``n_jobs`` is invalid, or neither
        torque nor controller is given.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.identification import RBDRegressor
    >>> log = make_hidden_effect_log(
    ...     load_planar_arm(), "stribeck", joints=[2], n_trajectories=6, duration=5.0
    ... )
    >>> diagnosis = diagnose(RBDRegressor(log.robot), log.X, log.y)
    >>> [(finding.kind, finding.joints) for finding in diagnosis.findings]
    [('stribeck', (2,))]
    """
    if not (hasattr(model, "fit") or hasattr(model, "predict")):
        raise ValueError(
            f"model is of type {type(model).__name__}; expected a regressor: diagnose(model, X, "
            "tau) with for example model=RBDRegressor(robot)"
        )
    # many small matrices: more threads would only wait for each other
    servos = None
    if tau is None:
        if controller is None:
            raise ValueError(
                "tau is None; pass the measured torque, or controller=Controller(...) for a log of "
                "position servos without"
            )
        servos = Servos(controller, X)
        tau = servos.torque
    with threadpool_limits(1), cores(n_jobs):
        opened = open_model(model, X, tau)
        diagnosis = _diagnose(
            opened.model,
            opened.X,
            tau,
            robot,
            effects,
            trajectory,
            time,
            rate,
            smooth,
            settings or Settings(),
            force,
            sample_weight,
            servos,
            checks,
        )
        if controller is not None:
            found = diagnosis.findings
            diagnosis.stated = None if servos is None else controller
            diagnosis.controller = with_settings(controller, found, len(diagnosis.joint_names))
        if opened.outer:
            diagnosis.opened = opened
            diagnosis.__dict__.pop("model", None)
        return diagnosis


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
    force: bool,
    sample_weight: Any,
    servos: Servos | None,
    known: Sequence[Suspicion] | None,
) -> Diagnosis:
    if isinstance(effects, str):
        raise EffectError(f"effects={effects!r} is one word; write a list, effects=[{effects!r}]")
    if not isinstance(settings, Settings):
        raise ValueError(f"settings={settings!r}; expected Settings(...) or None")
    if not isinstance(smooth, bool | np.bool_):
        raise ValueError(f"smooth={smooth!r}; expected True or False")
    stated = tau
    robot = robot if robot is not None else getattr(model, "robot", None)
    if robot is None:
        raise ColumnError(
            f"the model, a {type(model).__name__}, has no robot; pass robot=Robot.from_urdf(...)"
        )
    if not isinstance(robot, Robot):
        robot = Robot.from_urdf(robot)
    signals, torque = read_signals(
        X,
        tau,
        robot,
        trajectory=getattr(model, "trajectory", trajectory) if trajectory == "auto" else trajectory,
        time=getattr(model, "time", time) if time == "auto" else time,
        rate=rate,
        to_derive=smooth,
    )
    refuse_shuffled("A diagnosis", signals.trajectory, signals.time)
    weight = None
    if sample_weight is not None:
        weight = _check_sample_weight(
            sample_weight, torque, dtype=np.float64, ensure_non_negative=True
        )
    wanted = searched_kinds() if effects is None else list(effects)
    kinds, settings_tried = split_kinds(wanted, servos is not None)
    identified = getattr(model, "parameters", "identified") == "identified"
    if servos is not None and np.isfinite(servos.controller.checked(robot.n_joints).limit).all():
        kinds = [kind for kind in kinds if kind != "saturation"]

    logged = signals  # with copied rows, which are left out below

    def measured() -> Measurement:
        return Measurement(
            logged,
            torque,
            robot,
            robot.joint_names,
            identified=identified,
            of_servos=servos is not None,
        )

    # first, since all other effects and checks are judged by the torque that they determine
    of_servos = [] if servos is None else settings_found(measured(), servos, settings_tried)
    if servos is not None and of_servos:
        tau = torque = servos.with_findings(of_servos, robot.n_joints).torque
        # what is left of a setting that is known within an error would have their name
        alike = {rival for f in of_servos for rival in get_effect(f.kind).rivals}
        kinds = [kind for kind in kinds if kind not in alike]
    once = ~copied_rows(signals, torque)
    judged, kept_weight = torque, weight
    if not once.all():
        signals, judged = signals.take(once), torque[once]
        kept_weight = None if weight is None else weight[once]

    def checked() -> list[Suspicion]:
        checks = check_measurement(measured()) if known is None else list(known)
        if not force:
            refuse_certain(checks)
        return checks

    def posed() -> Problem:
        if not is_physics(model):
            left = (torque - _prediction(model, X, torque))[once]
            return _residual_problem(signals, left, robot, smooth, settings, kept_weight)
        return make_problem(
            signals,
            judged,
            robot=robot,
            rigid_body=identified,
            terms=own_terms(model, robot, X, tau),
            smooth=smooth,
            weight=kept_weight,
        )

    with aside(checked) as told:
        try:
            problem = posed()
            _check_rows(problem)
            if not torque.any():  # with force: otherwise the checks refuse it
                raise LogError(
                    "every torque is zero, so that no effect has a size: the torque was not "
                    "recorded. Record it, or name the columns that hold it"
                )
            # while the checks run on another core: they rarely change the search
            found = None if alone() else _search(problem, kinds, settings)
        except Exception as error:
            try:
                told()
            except SkidynError:
                raise  # an error in the log is more informative
            except Exception as other:
                raise error from other  # the checks failed for the same reason
            raise
        checks = told()
    notes = [str(check) for check in checks]
    doubts = [] if force else names_in_doubt(checks)
    if doubts and of_servos:  # what is doubtful may have looked like another servo
        return _diagnose(
            model, X, stated, robot, kinds, trajectory, time, rate, smooth, settings, force,
            sample_weight, servos, known,
        )  # fmt: skip
    if doubts:
        kinds, found = [], None
        notes.append(
            f"The measurement is in doubt ({'; '.join(doubts)}), so that no physical effect is "
            "identified: the missing torque is given as a function of the signals. Resolve the "
            "doubt, or continue with --force (in Python: force=True)."
        )
    for note in notes:
        warnings.warn(note, LogWarning, stacklevel=4)
    noted = {c.check for c in checks if c.certainty == "noted"} & {"clock_jitter"}
    steady = not {c.check for c in checks} & UNSTEADY - noted
    if found is None or not steady:
        if not alone():
            problem = posed()  # without data of the previous search
        found = _search(problem, kinds, settings, vibration=steady)
    problem, (result, wider, completed), left_out = look_after_beginnings(
        problem, found, kinds, lambda later: _search(later, kinds, settings, vibration=steady)
    )
    notes += [left_out] if left_out else []
    limits = _limits(problem, result, completed, settings)
    give_back()
    sliding = problem.rows.sliding
    data = (X, tau) if weight is None else (X, tau, weight)
    diagnosis = conclude(wider, completed, limits, sliding, judged, notes, settings, model, data)
    diagnosis.checks = checks
    diagnosis.findings = [_beside_doubts(f, checks) for f in diagnosis.findings]
    kept = {c.site for h in diagnosis.result.findings for c in h.candidates}
    sought = [c for h in completed.findings for c in h.candidates]
    withdrawn = [c for c in sought if c.site not in kept]
    diagnosis.limits = without_withdrawn(diagnosis.limits, withdrawn)
    diagnosis.findings[:0] = of_servos
    if of_servos and diagnosis.verdict == "complete":
        diagnosis.verdict = "missing"
    return diagnosis


def _beside_doubts(finding: Finding, checks: Sequence[Suspicion]) -> Finding:
    """The finding, less sure if a check suspects the signals of its joints or the whole log."""
    doubts = [s for s in checks if s.certainty != "noted"]
    if finding.confidence is None or not any(
        not s.joints or set(s.joints) & set(finding.joints) for s in doubts
    ):
        return finding
    return replace(finding, confidence=in_doubt(finding.confidence))


def _search(
    problem: Problem, kinds: list[str], settings: Settings, vibration: bool = True
) -> tuple[SearchResult, Problem, SearchResult]:
    """Missing effects from long windows, then the rows and findings of the closer searches.

    If the clock is in doubt, there is no search for a ``vibration``, which may be due to the
    logger.
    """
    result = search(problem, kinds, settings, vibration=vibration, given=problem.terms)
    give_back()  # what the unknown functions took: the next searches need fewer columns
    wider, completed = look_at_reversals(problem, result, kinds, settings)
    if wider is problem:
        give_back()
        wider, completed = look_at_swift(problem, result, kinds, settings)
    return result, wider, completed


def _limits(
    problem: Problem, result: SearchResult, completed: SearchResult, settings: Settings
) -> list[Limit]:
    """Limits of undetected effects in addition to all findings, on the sliding samples."""
    found = [c.term for h in completed.findings for c in h.candidates]
    blocks = [problem.term_rows(t) for t in (*problem.terms, *found)]
    counts = problem.rows.counts
    fit = result.fit
    inflation = variance_inflation(problem, fit.residual, range(problem.n_joints))
    block, _ = time_blocks(problem, block_length(problem, float(inflation.max())))
    gain = sum((h.gain for h in result.findings), np.zeros(problem.n_joints))
    share = np.expm1(np.maximum(np.asarray(gain, dtype=float), 0.0) / np.maximum(counts, 1))
    earlier = np.asarray(counts * share, dtype=np.float64)
    gates = Gates(settings, result.n_tests, block, counts, _whiteness(problem, fit), earlier)
    return find_limits(problem, result.candidates, blocks, fit.noise, inflation, gates)


def _whiteness(problem: Problem, fit: Fit) -> Array:
    """Variance of the residual of a sliding sample over that of an averaged row, by joint."""
    residual = problem.torque - problem.explained(fit)
    ones = np.ones(len(residual))
    ratio = np.ones(problem.n_joints)
    for j, r in enumerate(fit.residual):
        use = problem.rows.sliding[:, j]
        if len(r) and use.any():
            weight = problem.rows.average(ones, j)
            row = np.mean((r / weight) ** 2)
            ratio[j] = np.mean(residual[use, j] ** 2) / row if row > 0 else 1.0
    return ratio


def _check_rows(problem: Problem) -> None:
    empty = [j + 1 for j, n in enumerate(problem.rows.counts) if n < 8]
    if len(empty) == problem.n_joints:
        raise LogError(
            "no joint moves long enough for a diagnosis: the log is too short, scattered in "
            "time, or all joints are at rest"
        )


def _residual_problem(
    signals: Signals,
    residual: Array,
    robot: Robot,
    smooth: bool,
    settings: Settings,
    weight: Array | None,
) -> Problem:
    """Problem of the residual of a fitted model.

    A fitted model is biased by the effect it lacks, so its rigid body is free to change; so is its
    viscous and Coulomb friction, unless this is the missing effect.
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
            weight=weight,
        )

    friction = ["viscous", "coulomb"]
    bare = problem(())
    _check_rows(bare)
    if search(bare, friction, settings).findings:
        return problem(())
    return problem(make_terms(friction, robot.n_joints))


def own_terms(model: Any, robot: Robot, X: Any, tau: Any) -> list[Term]:
    """Terms of the user's model, with the shape parameters of its fit."""
    terms = make_terms(model.effects, robot.n_joints)
    if not any(t.is_open for t in terms):
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
