# SPDX-License-Identifier: BSD-3-Clause
"""The loop: compare a model with measurements, find where it fails, identify missing effects."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone
from sklearn.utils.validation import _check_sample_weight
from threadpoolctl import threadpool_limits

from skidyn._columns import ColumnSpec
from skidyn._cores import alone, aside, cores
from skidyn._exceptions import ColumnError, EffectError, LogError, LogWarning, SkidynError
from skidyn._memory import give_back
from skidyn._order import refuse_shuffled
from skidyn._signals import Array, Signals, read_signals
from skidyn._text import counted
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
from skidyn.diagnosis._rule import ROWS_PER_COEFFICIENT, Settings
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
#: What was found on long windows, the rows of the closer searches, and what was found in the end.
Found = tuple[SearchResult, Problem, SearchResult]


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
            _Question(
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
        )
        if controller is not None:
            found = diagnosis.findings
            diagnosis.stated = None if servos is None else controller
            diagnosis.controller = with_settings(controller, found, len(diagnosis.joint_names))
        if opened.outer:
            diagnosis.opened = opened
            diagnosis.__dict__.pop("model", None)
        return diagnosis


@dataclass(frozen=True)
class _Question:
    """What :func:`diagnose` is asked, with a model of one of the kinds that it knows."""

    model: Any
    X: Any
    tau: Any
    robot: Any
    effects: Iterable[str] | None
    trajectory: ColumnSpec
    time: ColumnSpec
    rate: float | None
    smooth: bool
    settings: Settings
    force: bool
    sample_weight: Any
    servos: Servos | None
    checks: Sequence[Suspicion] | None

    def checked_robot(self) -> Robot:
        """The robot, after invalid arguments were refused."""
        if isinstance(self.effects, str):
            word = self.effects
            raise EffectError(f"effects={word!r} is one word; write a list, effects=[{word!r}]")
        if not isinstance(self.settings, Settings):
            raise ValueError(f"settings={self.settings!r}; expected Settings(...) or None")
        if not isinstance(self.smooth, bool | np.bool_):
            raise ValueError(f"smooth={self.smooth!r}; expected True or False")
        robot = self.robot if self.robot is not None else getattr(self.model, "robot", None)
        if robot is None:
            raise ColumnError(
                f"the model, a {type(self.model).__name__}, has no robot; pass "
                "robot=Robot.from_urdf(...)"
            )
        return robot if isinstance(robot, Robot) else Robot.from_urdf(robot)

    def kinds(self, robot: Robot) -> tuple[list[str], list[str]]:
        """Effects that are tried, and settings of servos."""
        wanted = searched_kinds() if self.effects is None else list(self.effects)
        kinds, settings = split_kinds(wanted, self.servos is not None)
        if self.servos is not None:
            limit = self.servos.controller.checked(robot.n_joints).limit
            if np.isfinite(limit).all():
                kinds = [kind for kind in kinds if kind != "saturation"]
        return kinds, settings


class _Log:
    """The log of a question: its signals, and what is made of them."""

    def __init__(self, asked: _Question, robot: Robot) -> None:
        model = asked.model
        self.asked, self.robot, self.tau = asked, robot, asked.tau
        self.signals, self.torque = read_signals(
            asked.X,
            asked.tau,
            robot,
            trajectory=_key_of(model, "trajectory", asked.trajectory),
            time=_key_of(model, "time", asked.time),
            rate=asked.rate,
            to_derive=asked.smooth,
        )
        refuse_shuffled("A diagnosis", self.signals.trajectory, self.signals.time)
        self.weight = None
        if asked.sample_weight is not None:
            self.weight = _check_sample_weight(
                asked.sample_weight, self.torque, dtype=np.float64, ensure_non_negative=True
            )
        self.identified = getattr(model, "parameters", "identified") == "identified"

    def measured(self) -> Measurement:
        """All rows, as logged."""
        return Measurement(
            self.signals,
            self.torque,
            self.robot,
            self.robot.joint_names,
            identified=self.identified,
            of_servos=self.asked.servos is not None,
        )

    def checks(self) -> list[Suspicion]:
        """What the checks suspect; an error of the log that is certain is refused."""
        known, force = self.asked.checks, self.asked.force
        checks = check_measurement(self.measured()) if known is None else list(known)
        if not force:
            refuse_certain(checks)
        return checks

    @cached_property
    def once(self) -> NDArray[np.bool_]:
        """Rows that are no copies of others."""
        return ~copied_rows(self.signals, self.torque)

    def problem(self) -> Problem:
        """Rows and folds on which effects are judged."""
        asked, once = self.asked, self.once
        signals, torque, weight = self.signals, self.torque, self.weight
        if not once.all():
            signals, torque = signals.take(once), torque[once]
            weight = None if weight is None else weight[once]
        if not is_physics(asked.model):
            left = (self.torque - _prediction(asked.model, asked.X, self.torque))[once]
            return _residual_problem(
                signals, left, self.robot, asked.smooth, asked.settings, weight
            )
        return make_problem(
            signals,
            torque,
            robot=self.robot,
            rigid_body=self.identified,
            terms=own_terms(asked.model, self.robot, asked.X, self.tau),
            smooth=asked.smooth,
            weight=weight,
        )


def _key_of(model: Any, name: str, stated: ColumnSpec) -> ColumnSpec:
    """A key column as stated, or that of the model."""
    return getattr(model, name, stated) if stated == "auto" else stated


def _diagnose(asked: _Question) -> Diagnosis:
    robot = asked.checked_robot()
    log = _Log(asked, robot)
    kinds, settings_tried = asked.kinds(robot)
    # first, since all other effects and checks are judged by the torque that they determine
    servos, of_servos = asked.servos, []
    if servos is not None:
        of_servos = settings_found(log.measured(), servos, settings_tried)
    if servos is not None and of_servos:
        log.tau = log.torque = servos.with_findings(of_servos, robot.n_joints).torque
        # what is left of a setting that is known within an error would have their name
        alike = {rival for f in of_servos for rival in get_effect(f.kind).rivals}
        kinds = [kind for kind in kinds if kind not in alike]
    checks, problem, found = _checked_and_searched(log, kinds)
    notes = [str(check) for check in checks]
    doubts = [] if asked.force else names_in_doubt(checks)
    if doubts and of_servos:  # what is doubtful may have looked like another servo
        return _diagnose(replace(asked, robot=robot, effects=kinds))
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
    settings = asked.settings
    if found is None or not steady:
        if not alone():
            problem = log.problem()  # without data of the previous search
        found = _search(problem, kinds, settings, vibration=steady)
    problem, found, left_out = look_after_beginnings(
        problem, found, kinds, lambda later: _search(later, kinds, settings, vibration=steady)
    )
    notes += [left_out] if left_out else []
    diagnosis = _concluded(log, problem, found, notes)
    diagnosis.checks = checks
    diagnosis.findings = [_beside_doubts(f, checks) for f in diagnosis.findings]
    diagnosis.findings[:0] = of_servos
    if of_servos and diagnosis.verdict == "complete":
        diagnosis.verdict = "missing"
    return diagnosis


def _checked_and_searched(
    log: _Log, kinds: list[str]
) -> tuple[list[Suspicion], Problem, Found | None]:
    """What the checks suspect, the problem and, with several processes, what a search found.

    The checks run on another core meanwhile: they rarely change the search.
    """
    with aside(log.checks) as told:
        try:
            problem = log.problem()
            _check_rows(problem, getattr(log.asked.X, "attrs", {}).get("files", ()))
            if not log.torque.any():  # with force: otherwise the checks refuse it
                raise LogError(
                    "every torque is zero, so that no effect has a size: the torque was not "
                    "recorded. Record it, or name the columns that hold it"
                )
            found = None if alone() else _search(problem, kinds, log.asked.settings)
        except Exception as error:
            try:
                told()
            except SkidynError:
                raise  # an error in the log is more informative
            except Exception as other:
                raise error from other  # the checks failed for the same reason
            raise
        return told(), problem, found


def _concluded(log: _Log, problem: Problem, found: Found, notes: list[str]) -> Diagnosis:
    """The diagnosis of what was found, with limits of what was not."""
    asked, (result, wider, completed) = log.asked, found
    limits = _limits(problem, result, completed, asked.settings)
    give_back()
    data = (asked.X, log.tau) if log.weight is None else (asked.X, log.tau, log.weight)
    diagnosis = conclude(
        wider,
        completed,
        limits,
        problem.rows.sliding,
        log.torque[log.once],
        notes,
        asked.settings,
        asked.model,
        data,
    )
    kept = {c.site for h in diagnosis.result.findings for c in h.candidates}
    sought = [c for h in completed.findings for c in h.candidates]
    withdrawn = [c for c in sought if c.site not in kept]
    diagnosis.limits = without_withdrawn(diagnosis.limits, withdrawn)
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
) -> Found:
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


#: Averaging windows of one joint at least.
FEWEST_WINDOWS = 8


def _check_rows(problem: Problem, files: Sequence[str] = ()) -> None:
    """Refuse a log, of some files, in which the joints do not move long enough."""
    counts = problem.rows.counts
    width = len(problem.rigid_index) + problem.terms.width
    if max(counts) >= FEWEST_WINDOWS and sum(counts) >= ROWS_PER_COEFFICIENT * width:
        return
    names = list(dict.fromkeys(files))
    source = f"{names[0]}: " if len(names) == 1 else ""
    signals = problem.signals
    steps = zip(signals.segments, signals.steps, strict=True)
    length = sum(step * (rows.stop - rows.start - 1) for rows, step in steps)
    raise LogError(
        f"{source}no joint moves long enough for a diagnosis: of the {length:.3g} s in "
        f"{counted(len(np.unique(signals.trajectory)), 'trajectory')}, "
        f"{counted(int(sum(counts)), 'averaging window')} away from rest and reversals are left, "
        f"at most {int(max(counts))} for a joint; {ROWS_PER_COEFFICIENT * width} are needed, "
        f"and {FEWEST_WINDOWS} for a joint. Record at least 10 s in which every joint moves, "
        "better several trajectories, or pass further recordings"
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
