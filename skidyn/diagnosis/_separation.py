# SPDX-License-Identifier: BSD-3-Clause
"""A motion that separates rivals: optimised for torque that only one of them explains.

Two effects that a log cannot separate predict the same torque there, and different ones elsewhere.
The motion is a Fourier series on the joints in question, blended from and to rest, within the
limits of position, velocity and acceleration. The maximised criterion is the squared torque of the
first model, in units of the noise, that the rival does not explain with all its coefficients fitted
again (a T-optimal design; Atkinson, Fedorov 1975). The result is then simulated with sensor noise,
once with each rival as the truth, and analysed by the same search as the real recording.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np
from scipy.optimize import OptimizeResult, differential_evolution

from skidyn._exceptions import EffectError
from skidyn._progress import tell
from skidyn._signals import Array, Signals, read_signals
from skidyn._text import listed
from skidyn.diagnosis._hypothesis import UNKNOWN, Hypothesis, least_sure
from skidyn.diagnosis._rule import Settings
from skidyn.diagnosis._search import search
from skidyn.effects import Term, get_effect
from skidyn.evidence import Fit, Problem, hysteresis_joints, make_problem
from skidyn.excitation import fourier, product, rest_window

if TYPE_CHECKING:
    from skidyn.diagnosis._findings import Finding
    from skidyn.diagnosis._result import Diagnosis

#: Harmonics of the series, and lowest and highest base frequency in Hz.
HARMONICS, SLOWEST, FASTEST = 4, 0.05, 0.5
#: Smallest amplitude tried, as a share of the largest; hysteresis is visible in small strokes.
SMALLEST_STROKE = 0.003
#: Time of blending from and to rest, s.
BLEND = 0.5
#: Squared torque, in units of the noise, below which effects cannot be separated.
LEAST_GAIN = 20.0
#: Number of trajectories of the simulated check, and rounds and size of the evolution.
TRAJECTORIES, ROUNDS, POPULATION = 4, 12, 6


class _WithRivals(Protocol):
    """A finding, or what a report tells of it."""

    @property
    def kind(self) -> str: ...

    @property
    def rivals(self) -> Sequence[str]: ...


_Finding = TypeVar("_Finding", bound=_WithRivals)


@dataclass(frozen=True)
class SeparatingMotion:
    """A motion that separates two explanations.

    Parameters
    ----------
    kind, rival : str
        The two effects.
    joints : tuple of int
        Joints that move, counted from 1.
    time : ndarray of shape (n_samples,), s
        Time.
    q, dq, ddq : ndarray of shape (n_samples, n_joints)
        Motion of all joints, SI units.
    gain : float
        Squared torque, in units of the noise, that the rival cannot explain on this motion.
    gain_of_log : float
        The same for a part of equal length of the diagnosed log.
    confirmed : dict of str to bool
        For each effect as the truth: whether the diagnosis of a simulated recording of this motion
        finds it.

    Examples
    --------
    >>> motion = design_separating_motion(diagnosis)  # doctest: +SKIP
    >>> motion.to_frame().to_csv("separate.csv", index=False)  # doctest: +SKIP
    """

    kind: str
    rival: str
    joints: tuple[int, ...]
    time: Array = field(repr=False)
    q: Array = field(repr=False)
    dq: Array = field(repr=False)
    ddq: Array = field(repr=False)
    gain: float
    gain_of_log: float
    confirmed: dict[str, bool]

    @property
    def sentence(self) -> str:
        """Description of the motion."""
        joints = "joint" if len(self.joints) == 1 else "joints"
        which = f"{joints} {', '.join(map(str, self.joints))}"
        if self.gain < LEAST_GAIN:
            return (
                f"No motion of {which} within the limits separates {self.kind} from {self.rival}: "
                "with their coefficients from this log, both cause the same torque."
            )
        text = (
            f"This motion of {which} ({self.time[-1]:.0f} s) separates {self.kind} from "
            f"{self.rival}: the torque that the rival cannot explain is {self.gain:.3g} in units "
            f"of the noise, against {self.gain_of_log:.3g} in a part of the log of equal length."
        )
        if all(self.confirmed.values()):
            return text + " In simulated recordings of this motion both effects were recognised."
        wrong = [kind for kind, right in self.confirmed.items() if not right]
        missed = f"{wrong[0]} was still not" if len(wrong) == 1 else "neither of the two was"
        longer = 2 * self.time[-1]
        return (
            f"{text} In a simulated recording with {listed(wrong, 'or')} as the truth, {missed} "
            "recognised. Repeat the motion in several recordings, or design a longer one: "
            f"--duration {longer:.0f} (in Python: duration={longer:.0f})."
        )

    def to_frame(self) -> Any:
        """Table of the motion.

        Returns
        -------
        DataFrame
            Columns ``time, q1.., dq1.., ddq1..``.
        """
        import pandas

        n = self.q.shape[1]
        names = [f"{s}{j + 1}" for s in ("q", "dq", "ddq") for j in range(n)]
        table = pandas.DataFrame(np.hstack([self.q, self.dq, self.ddq]), columns=names)
        table.insert(0, "time", self.time)
        return table


@dataclass(frozen=True)
class _Duel:
    """Two models that explain the same log, and the limits of the robot's motion."""

    problem: Problem
    first: Fit
    second: Fit
    joints: tuple[int, ...]
    middle: Array
    stroke: Array
    speed: Array
    acceleration: Array
    torque_noise: Array
    position_noise: Array
    rate: float
    duration: float

    @property
    def reversals(self) -> list[int]:
        """Joints, from 0, whose rows reach up to the reversals."""
        return hysteresis_joints((*self.first.terms, *self.second.terms))

    def motion(self, x: Array) -> tuple[Array, Array, Array, Array]:
        """Time and motion of a point of the search space, scaled to keep the limits."""
        time = np.arange(0.0, self.duration, 1 / self.rate)
        q = np.tile(self.middle, (len(time), 1))
        dq, ddq = np.zeros_like(q), np.zeros_like(q)
        window = rest_window(time, self.duration, BLEND)
        omega = 2 * np.pi * SLOWEST * (FASTEST / SLOWEST) ** x[0]
        size = len(x[1:]) // len(self.joints)
        for i, j in enumerate(self.joints):
            own = x[1 + i * size : 1 + (i + 1) * size]
            wave = fourier(time, omega, own[1:])
            wave /= np.max(np.abs(wave[0])) + 1e-12
            s, ds, dds = product(window, wave)
            amplitude = self.stroke[j] * SMALLEST_STROKE ** (1 - own[0])
            amplitude = min(
                amplitude,
                self.speed[j] / max(np.max(np.abs(ds)), 1e-9),
                self.acceleration[j] / max(np.max(np.abs(dds)), 1e-9),
                self.stroke[j] / max(np.max(np.abs(s)), 1e-9),
            )
            q[:, j] += amplitude * s
            dq[:, j], ddq[:, j] = amplitude * ds, amplitude * dds
        return time, q, dq, ddq

    def signals(self, time: Array, q: Array, dq: Array, ddq: Array) -> Signals:
        """Signals of a motion, with the load of the first model."""
        robot = self.problem.robot
        assert robot is not None
        parameters = self.problem.inertial_parameters(self.first)
        load = robot.inverse_dynamics(q, dq, ddq, parameters=parameters)
        s = self.problem.signals
        temperature = None
        if s.temperature is not None:
            temperature = np.tile(np.median(s.temperature, axis=0), (len(q), 1))
        return Signals(
            q, dq, ddq, np.zeros(len(q), dtype=np.int64), time, temperature, s.prismatic, robot,
            load, load, load, parameters,
        )  # fmt: skip

    def gain(self, signals: Signals) -> float:
        """Squared torque of the first model that the second does not explain, in noise units."""
        torque = self.torque(signals, self.first)
        problem = make_problem(
            signals,
            torque,
            robot=self.problem.robot,
            rigid_body=self.problem.rigid_body,
            terms=self.second.terms,
            smooth=False,
            subtract_urdf=False,
            reversals=self.reversals,
        )
        if any(count < 8 for count in problem.rows.counts[list(self.joints)]):
            return 0.0
        fit = problem.fit(self.second.terms, sigma=self.first.noise)
        parts = zip(fit.residual, self.first.noise, strict=True)
        return float(sum(np.sum((r / s) ** 2) for r, s in parts))

    def torque(self, signals: Signals, fit: Fit) -> Array:
        """Torque of a model beyond the URDF's rigid body, N m or N."""
        on_motion = replace(self.problem, signals=signals, torque=np.zeros_like(signals.q))
        return on_motion.explained(fit)


def design_separating_motion(
    diagnosis: Diagnosis,
    kind: str | None = None,
    rival: str | None = None,
    *,
    duration: float = 20.0,
    random_state: int = 0,
) -> SeparatingMotion:
    """Design a motion that separates a finding from a rival.

    Parameters
    ----------
    diagnosis : Diagnosis
        Diagnosis with the finding.
    kind : str, optional
        Kind of the finding; by default the first one that has a rival of the catalogue.
    rival : str, optional
        The other explanation; by default its closest rival.
    duration : float, s, default=20
        Length of the motion.
    random_state : int, default=0
        Seed of the optimisation and of the simulated noise.

    Returns
    -------
    SeparatingMotion
        Motion within the limits of the URDF and of the log.

    Raises
    ------
    EffectError
        There is no such finding, or the search has not compared it with this rival.

    Examples
    --------
    >>> from skidyn.diagnosis import design_separating_motion
    >>> motion = design_separating_motion(diagnosis, "dahl", "maxwell_slip")  # doctest: +SKIP
    """
    first, second = _opponents(diagnosis, kind, rival)
    duel = _duel(diagnosis, first, second, duration)
    size = 1 + 2 * HARMONICS

    def loss(x: Array) -> float:
        return -duel.gain(duel.signals(*duel.motion(x)))

    bounds = [(0.0, 1.0)]
    for _ in duel.joints:
        bounds += [(0.0, 1.0)] + [(-1.0, 1.0)] * (size - 1)

    def told(intermediate_result: OptimizeResult) -> None:
        tell("Designing the motion", intermediate_result.nit / ROUNDS)

    best = differential_evolution(
        loss,
        bounds,
        callback=told,
        maxiter=ROUNDS,
        popsize=POPULATION,
        init="sobol",
        polish=False,
        rng=random_state,
    )
    motion = duel.motion(best.x)
    return SeparatingMotion(
        first.kind,
        second.kind,
        tuple(j + 1 for j in duel.joints),
        *motion,
        gain=float(-best.fun),
        gain_of_log=_gain_of_log(duel),
        confirmed={
            one.kind: _recognised(duel, motion, fit, (one.kind, other.kind), random_state)
            for one, other, fit in ((first, second, duel.first), (second, first, duel.second))
        },
    )


def separable_rivals(kind: str, rivals: Iterable[str]) -> list[str]:
    """Rivals of a finding from which a motion can separate it.

    Unknown functions predict no torque on other motion, and settings of a servo are no torque.

    Parameters
    ----------
    kind : str
        Kind of the finding.
    rivals : iterable of str
        Kinds from which the log cannot separate it.

    Returns
    -------
    list of str
        In the given order; empty for a finding that a motion cannot separate.
    """
    if kind == UNKNOWN or get_effect(kind).of_servo:
        return []
    return [rival for rival in rivals if rival != UNKNOWN and not get_effect(rival).of_servo]


def findings_to_separate(
    findings: Sequence[_Finding], kind: str | None = None, rival: str | None = None
) -> list[_Finding]:
    """Findings that a motion may separate from a rival, those with the announced rival first.

    Parameters
    ----------
    findings : sequence of Finding
        Findings of a diagnosis, or what a report tells of them: ``kind`` and ``rivals``.
    kind : str, optional
        Kind of the finding.
    rival : str, optional
        Kind of the rival, which may also be one that explains less; else one of :attr:`rivals`.

    Returns
    -------
    list of Finding
        At least one.

    Raises
    ------
    EffectError
        There is none.
    """
    rivals = [separable_rivals(f.kind, f.rivals) for f in findings]
    asked = [kind in (None, f.kind) for f in findings]
    pairs = list(zip(findings, rivals, asked, strict=True))
    if rival is None:
        chosen = [f for f, known, is_asked in pairs if is_asked and known]
    else:
        able = [
            (f, known)
            for f, known, is_asked in pairs
            if is_asked and f.kind != rival and separable_rivals(f.kind, [rival])
        ]
        chosen = [f for f, _ in sorted(able, key=lambda pair: rival not in pair[1])]
    if chosen:
        return chosen
    told: dict[str, list[str]] = {}
    for f, known, _ in pairs:
        if known:
            told.setdefault(f.kind, []).extend(known)
    shown = [f"{own} from {listed([*dict.fromkeys(known)], 'or')}" for own, known in told.items()]
    if not shown:
        raise EffectError(
            "there is nothing to separate: no finding has a rival of the catalogue that this data "
            "cannot separate from it"
        )
    raise EffectError(
        f"no finding {kind or 'other than ' + str(rival)} that a motion could separate from "
        f"{rival or 'a rival'}; choose one that it can: {'; '.join(shown)}"
    )


def _opponents(
    diagnosis: Diagnosis, kind: str | None, rival: str | None
) -> tuple[Hypothesis, Hypothesis]:
    """The finding, as it was compared, and the rival."""
    compared: list[str] = []
    for finding in findings_to_separate(diagnosis.findings, kind, rival):
        names = [rival] if rival else separable_rivals(finding.kind, finding.rivals)
        for own, other in _compared(diagnosis, finding):
            if other.kind in names:
                return own, other
            compared += separable_rivals(own.kind, [other.kind])
    told = listed([*dict.fromkeys(compared)]) or "no other effect"
    raise EffectError(
        f"the search has not compared {kind or 'a finding'} with {rival or 'a rival'}, only with "
        f"{told}; choose one of those as rival"
    )


def _compared(diagnosis: Diagnosis, finding: Finding) -> Iterator[tuple[Hypothesis, Hypothesis]]:
    """What was compared on the joints of a finding, the best first."""
    for found in diagnosis.result.findings:
        if not any(c.term in finding.terms for c in found.candidates):
            continue
        # an effect on several joints may have other rivals on each of them
        alone = least_sure(found, [j - 1 for j in finding.joints])
        for own in (found, alone):
            yield from ((own, h) for h in own.others if set(own.joints) & set(h.joints))


def _duel(diagnosis: Diagnosis, first: Hypothesis, second: Hypothesis, duration: float) -> _Duel:
    problem, robot = diagnosis.problem, diagnosis.problem.robot
    assert robot is not None
    judged = {c.term for c in first.candidates}
    found = [c.term for h in diagnosis.result.findings for c in h.candidates]
    rest = [t for t in found if t not in judged and t.effect.search != "spectrum"]
    terms: list[list[Term]] = [
        [*problem.terms, *rest, *(c.term for c in h.candidates)] for h in (first, second)
    ]
    problem = replace(problem, torque=problem.torque - diagnosis.result.ripple)
    sigma = diagnosis.result.fit.noise
    s = problem.signals
    low, high = np.quantile(s.q, [0.001, 0.999], axis=0)
    low = np.maximum(low, robot.position_limits[:, 0])
    high = np.minimum(high, robot.position_limits[:, 1])
    speed = np.minimum(np.quantile(np.abs(s.dq), 0.999, axis=0), robot.velocity_limits)
    return _Duel(
        problem,
        problem.fit(terms[0], sigma=sigma),
        problem.fit(terms[1], sigma=sigma),
        _moving(first, second, problem.n_joints),
        (low + high) / 2,
        (high - low) / 2,
        speed,
        np.quantile(np.abs(s.ddq), 0.999, axis=0),
        # Rows have unit noise gain: their noise is that of a sample.
        sigma,
        _position_noise(diagnosis),
        min(problem.signals.rate, 200.0),
        duration,
    )


def _moving(first: Hypothesis, second: Hypothesis, n_joints: int) -> tuple[int, ...]:
    """Joints that have to move, including those that load others for effects of the load."""
    joints = {j for h in (first, second) for j in h.joints}
    if any("load" in get_effect(h.kind).needs for h in (first, second)):
        return tuple(range(n_joints))
    return tuple(sorted(joints))


def _gain_of_log(duel: _Duel) -> float:
    """Torque that the rival does not explain on the log, for the duration of the motion."""
    problem = duel.problem
    bare = replace(problem, torque=problem.explained(duel.first))
    fit = bare.fit(duel.second.terms, sigma=duel.first.noise)
    parts = zip(fit.residual, duel.first.noise, strict=True)
    whole = sum(float(np.sum((r / s) ** 2)) for r, s in parts)
    signals = problem.signals
    length = sum(float(np.ptp(signals.clock[rows])) for rows in signals.segments)
    return whole * duel.duration / max(length, duel.duration)


def _recognised(
    duel: _Duel, motion: Sequence[Array], truth: Fit, kinds: tuple[str, str], random_state: int
) -> bool:
    """Whether simulated recordings of the motion are diagnosed as the first of two kinds."""
    rng = np.random.default_rng(random_state)
    time, *states = (np.concatenate([x] * TRAJECTORIES) for x in motion)
    number = np.repeat(np.arange(TRAJECTORIES), len(motion[0]))
    signals = duel.signals(time, *states).with_(trajectory=number)
    torque = duel.torque(signals, truth) + duel.torque_noise * rng.normal(size=states[0].shape)
    measured = signals.q + duel.position_noise * rng.normal(size=states[0].shape)
    problem = make_problem(
        signals.with_(q=measured),
        torque,
        robot=duel.problem.robot,
        rigid_body=duel.problem.rigid_body,
        terms=[t for t in duel.first.terms if t in duel.second.terms],
        subtract_urdf=False,
        reversals=duel.reversals,
    )
    result = search(problem, kinds, Settings(max_findings=1), nameless=False)
    return [h.kind for h in result.findings] == [kinds[0]]


def _position_noise(diagnosis: Diagnosis) -> Array:
    """Noise of the logged positions, removed by the smoother, (n_joints,), rad or m."""
    model, (X, tau, *_) = diagnosis.base_model, diagnosis.data
    robot = diagnosis.problem.robot
    assert robot is not None
    raw, _ = read_signals(
        X,
        tau,
        robot,
        trajectory=getattr(model, "trajectory", "auto"),
        time=getattr(model, "time", "auto"),
        rate=diagnosis.problem.signals.rate,
    )
    smooth = diagnosis.problem.signals
    rough = (raw.q - smooth.q)[smooth.usable.all(1)]
    return np.asarray(np.std(rough, axis=0))
