# SPDX-License-Identifier: BSD-3-Clause
"""Effects identified from the motion of servos, by simulation of the logged motion.

The torque that accelerates a link is known from positions that were differentiated twice, with all
their noise. This noise hides an effect that lasts hundredths of a second, while the motion that it
causes is far above the noise of the encoder. So each joint is simulated in its loop, with the
others as logged, with its friction alone and with one effect more; models fitted to half of the
pieces are tested on the other half. The effect with the largest gain is added, and the others are
compared again in addition to it. A link that moves relative to its motor acts on the other joints:
after its gear is identified, they are simulated along the motion of the link, and not along that of
its motor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np
from scipy.ndimage import maximum_filter1d

from skidyn._columns import names_of_table, resolve_columns
from skidyn._exceptions import LogError, SkidynError
from skidyn._joint_numbers import joint_numbers
from skidyn._progress import track
from skidyn._signals import Array
from skidyn._text import inside, joints_of, measure
from skidyn.effects import get_effect
from skidyn.forward import Controller, JointLoop, Task, read_task
from skidyn.simulation._servo_fit import Fit, covariance, fit_all
from skidyn.simulation._servo_laws import (
    FRICTION,
    GEARS,
    LAWS,
    Range,
    halves_told,
    rivals_of,
    sizes_told,
    starts_of,
)

#: Length of a piece, s, and fewest pieces.
PIECE, FEWEST_PIECES = 6.0, 4
#: Multiple of the noise of the positions, and least noise, rad or m, above which an effect is
#: missing.
STANDS_OUT, SMALLEST = 2.5, 2e-5
#: Share of the squared error that a finding must remove, held out, and more than that
#: share of the pieces on which it must help.
LEAST_DROP, LEAST_PIECES = 0.3, 0.5
#: The same for a second effect on a joint, because others explain part of the error of an effect
#: that is not exact.
SECOND_DROP = 0.6
#: Largest error of the simulation with the finding, as a share of that of the command itself.
NEARER = 0.5
#: Least share of the gain that the best other explanation does not have.
MARGIN = 0.15
#: Most effects of one joint.
MOST = 2


@dataclass(frozen=True)
class ServoFinding:
    """An effect that is needed to simulate the motion of a servo.

    Parameters
    ----------
    kind : str
        Kind of the catalogue; ``"servo_deadband"`` is missing in the controller and not in the
        model.
    joint : int
        Joint, counted from 1.
    parameters : dict of str to float
        Sizes in SI units.
    before, after : float
        Root mean square error of the simulated position without and with it, on pieces that were
        left out of the fit, rad or m.
    rival : str
        The next best explanation of this joint.
    beside : float
        Error that the next best explanation leaves, rad or m.
    unit : {"rad", "m"}, default="rad"
        That of the joint's position.
    halves : dict of str to float
        Half the widths of the 95 % intervals of the parameters.

    Examples
    --------
    >>> found = ServoFinding("coulomb", 2, {"Fc": 0.31}, 0.012, 0.002, "viscous", 0.009)
    >>> found.sentence.split(":")[0]
    'Coulomb friction of joint 2 (Fc = 0.31 N m)'
    """

    kind: str
    joint: int
    parameters: dict[str, float]
    before: float
    after: float
    rival: str
    beside: float
    unit: Literal["rad", "m"] = "rad"
    halves: dict[str, float] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """Title of the effect."""
        return get_effect(self.kind).title

    @property
    def size(self) -> str:
        """Its parameters with their units."""
        told = []
        for name, value in self.parameters.items():
            half = self.halves.get(name)
            row = value if half is None else (value, value - half, value + half)
            told.append(measure(name, row, self._units.get(name, "")))
        return ", ".join(told)

    @property
    def _units(self) -> dict[str, str]:
        return get_effect(self.kind).units(self.unit == "m")

    @property
    def sentence(self) -> str:
        """Sentence on the finding."""
        return f"{self.title} of joint {self.joint} ({self.size}): {self.evidence}."

    @property
    def evidence(self) -> str:
        """Influence on the simulated motion, compared with the next best explanation."""
        before, after, beside = (
            f"{1e3 * error:.3g}" for error in (self.before, self.after, self.beside)
        )
        said = f"the error of the simulated motion is {after} instead of {before} m{self.unit}"
        if self.beside >= self.before:
            return f"{said}; no other effect reduces it"
        return f"{said}; with {inside(get_effect(self.rival).title)} it would be {beside}"

    def to_dict(self) -> dict[str, Any]:
        """As in the report of a diagnosis.

        Returns
        -------
        dict
            The parameters above, and ``sentence``.
        """
        told = asdict(self)
        del told["halves"]
        return {**told, "sentence": self.sentence}

    def to_effect(self) -> dict[str, Any]:
        """As one of the effects in the report of a diagnosis.

        Returns
        -------
        dict
            ``kind``, ``joints``, ``parameters`` with 95 % intervals, ``error_drop`` (share of the
            squared error of the simulated position that it removes), ``q_value`` (None: effects are
            judged by their error on held-out pieces), ``rivals``, ``separating_motion``,
            ``sentence`` and ``judged_by``, which is ``"motion"``.
        """
        parameters = {}
        for name, value in self.parameters.items():
            half = self.halves.get(name)
            low, high = (None, None) if half is None else (value - half, value + half)
            unit = self._units.get(name, "1")
            parameters[name] = {"value": value, "low": low, "high": high, "unit": unit}
        return {
            "kind": self.kind,
            "joints": [self.joint],
            "parameters": parameters,
            "error_drop": 1.0 - (self.after / self.before) ** 2,
            "q_value": None,
            "rivals": [],
            "separating_motion": get_effect(self.kind).separating_motion,
            "sentence": self.sentence,
            "judged_by": "motion",
        }

    def __str__(self) -> str:
        return self.sentence


def explain_servo_motion(
    model: Any,
    X: Any,
    controller: Controller,
    *,
    joints: int | Sequence[int] | None = None,
    known: Sequence[tuple[str, int]] = (),
) -> list[ServoFinding]:
    """Find effects that are missing in the simulated motion of position servos.

    Every joint is simulated along its command, with the bodies and rotor inertias of the model,
    the other joints as logged, and viscous and dry friction fitted to the motion. If the error
    exceeds the noise of the positions, the following effects are compared: stiction, friction that
    depends on the load, the direction, or the square of the speed, presliding, delay, elasticity
    and backlash, and a deadband of the servo if the controller has none. Each is fitted to half of
    the pieces of the log and evaluated on the others. The effect that removes the largest share of
    the squared error of a joint is selected; then the others are tested together with it, on its
    joint and, along the motion of its link, on the other joints, with at most two on a joint. No
    effect is reported if the error of the simulation is at least half of that of the command
    itself, which indicates wrong gains or bodies.

    Parameters
    ----------
    model : RBDRegressor
        Fitted to the servo's torque (:func:`servo_torque`).
    X : DataFrame
        ``time`` (s), ``q1..``, ``dq1..`` (rad, m; rad/s, m/s), commands ``q_ref1..`` or ``cmd1..``,
        and ``trajectory`` if there are several recordings; at least four pieces of 3 s.
    controller : Controller
        Gains, delay and limit of the servos.
    joints : int or sequence of int, optional
        Joints, counted from 1, to be analysed; all by default.
    known : sequence of (str, int)
        Kinds and joints of effects that are part of the simulation from the start; unsupported ones
        are left out.

    Returns
    -------
    list of ServoFinding
        In the order of selection.

    Raises
    ------
    SkidynError
        A column is missing.
    LogError
        The log is too short.

    See Also
    --------
    skidyn.diagnosis.diagnose : Effects missing in the servo's torque.

    Examples
    --------
    >>> from skidyn.simulation import explain_servo_motion
    >>> found = explain_servo_motion(model, log, servo)  # doctest: +SKIP
    >>> print(found[0].sentence)  # doctest: +SKIP
    """
    n = model.robot_.n_joints
    wanted = list(range(1, n + 1)) if joints is None else joint_numbers(joints)
    strange = [j for j in wanted if not 1 <= j <= n]
    if strange:
        raise SkidynError(f"joints={wanted}; the robot has {joints_of(n)}")
    task = read_task(model, X, None, controller, PIECE)
    pieces = len(task.windows.rows)
    if pieces < FEWEST_PIECES:
        raise LogError(
            f"the log holds {pieces} piece(s) of {PIECE:g} s; effects are judged on held-out "
            f"pieces, which requires {FEWEST_PIECES}"
        )
    least = STANDS_OUT * np.maximum(_encoder_noise(model.robot_, X, task.signals.q), SMALLEST)
    arm = _Arm(model, task, known, {j - 1 for j in wanted})
    named: list[ServoFinding] = []
    while True:
        failing = [
            joint
            for joint in arm.joints
            if joint.index + 1 in wanted
            and len(joint.kinds) < MOST
            and np.sqrt(joint.plain.mean) > least[joint.index]
        ]
        for joint in track(failing, "Comparing effects"):
            joint.compare()
        found = [(joint.answer, joint) for joint in failing if joint.answer is not None]
        if not found:
            break
        answer, best = min(found, key=lambda pair: pair[0].ratio)
        named.append(answer.finding)
        again = arm.take(best)
        named = [f for f in named if f.joint - 1 not in again or f.kind in GEARS]
    slides = [kind == "prismatic" for kind in model.robot_.joint_types]
    return [replace(f, unit="m" if slides[f.joint - 1] else "rad") for f in named]


@dataclass(frozen=True)
class _Answer:
    """Best explanation of a joint."""

    finding: ServoFinding
    fit: Fit
    law: dict[str, Range]

    @property
    def ratio(self) -> float:
        return self.finding.after / self.finding.before


@dataclass
class _Joint:
    """A joint with its known effects."""

    index: int
    loop: JointLoop
    given: tuple[str, ...]
    start: dict[str, float]
    kinds: tuple[str, ...] = ()
    ranges: dict[str, Range] = field(default_factory=dict)
    answer: _Answer | None = None
    compared: bool = False

    def restart(self, keep_gears: bool) -> None:
        """Fit friction and known effects again."""
        kept = tuple(k for k in self.kinds if keep_gears and k in GEARS)
        self.kinds = (*self.given, *(k for k in kept if k not in self.given))
        models = [FRICTION]
        for kind in self.kinds:
            models = [{**model, **law} for model in models for law in starts_of(kind)]
        fits = fit_all(self.loop, models, self.start)
        best = min(range(len(fits)), key=lambda k: fits[k].mean)
        self.ranges, self.plain = models[best], fits[best]
        self.answer, self.compared = None, False

    def compare(self) -> None:
        """Search for the effect that explains the motion."""
        if not self.compared:
            self.answer, self.compared = _name(self), True

    def take(self) -> None:
        """Add the found effect to the known ones."""
        assert self.answer is not None
        self.kinds = (*self.kinds, self.answer.finding.kind)
        self.ranges = {**self.ranges, **self.answer.law}
        self.plain = self.answer.fit
        self.answer, self.compared = None, False


class _Arm:
    """All joints in their loops."""

    def __init__(
        self, model: Any, task: Task, known: Sequence[tuple[str, int]], wanted: set[int]
    ) -> None:
        self.model, self.task = model, task
        self.behind: dict[int, Array] = {}
        kinds = {
            j: tuple(dict.fromkeys(k for k, joint in known if joint == j + 1 and k in LAWS))
            for j in range(model.robot_.n_joints)
        }
        gears = [j for j in kinds if set(kinds[j]) & set(GEARS)]
        self.joints = []
        rest = [j for j in kinds if j not in gears and j in wanted]
        for j in track([*gears, *rest], "Simulating the servos"):
            joint = _Joint(j, self._loop(j), kinds[j], _given(model, j))
            joint.restart(keep_gears=False)
            self.joints.append(joint)
            if j in gears:
                self._see_link(joint)

    def take(self, joint: _Joint) -> set[int]:
        """Add the explanation of a joint; returns the joints to be searched again."""
        joint.take()
        if joint.kinds[-1] not in GEARS:
            return set()
        self._see_link(joint)
        others = [other for other in self.joints if other is not joint]
        for other in others:
            other.loop = self._loop(other.index)
            other.restart(keep_gears=True)
        return {other.index for other in others}

    def _see_link(self, joint: _Joint) -> None:
        """Lag of the link behind its motor, on which its own load depends, too."""
        self.behind[joint.index] = joint.loop.twist(joint.plain.values)
        joint.loop = self._loop(joint.index)
        (joint.plain,) = fit_all(joint.loop, [joint.ranges], joint.plain.values)
        self.behind[joint.index] = joint.loop.twist(joint.plain.values)

    def _loop(self, j: int) -> JointLoop:
        """A joint in its loop, with bodies and rotor inertias of the model."""
        model, robot, signals = self.model, self.model.robot_, self.task.signals
        q, dq, ddq = signals.q.copy(), signals.dq.copy(), signals.ddq.copy()
        rows = self.task.windows.rows
        for other, twist in self.behind.items():
            # A jump of the link where its motor is reset to the log is not a motion.
            held = next(x.loop.held for x in self.joints if x.index == other)
            still = maximum_filter1d(held.astype(np.uint8), 7, axis=0) > 0
            clock = self.task.windows.time.T
            rate = np.stack([np.gradient(x, t) for x, t in zip(twist.T, clock.T, strict=True)])
            rise = np.stack([np.gradient(x, t) for x, t in zip(rate, clock.T, strict=True)])
            q[rows, other] -= twist.T
            dq[rows, other] -= np.where(still.T, 0.0, rate)
            ddq[rows, other] -= np.where(still.T, 0.0, rise)
        bodies = model.inertial_parameters_
        rigid = robot.inverse_dynamics(q, dq, ddq, parameters=bodies)[:, j]
        turn = np.zeros_like(ddq)
        turn[:, j] = 1.0
        link = robot.inverse_dynamics(
            q, np.zeros_like(dq), turn, parameters=bodies, gravity=(0.0, 0.0, 0.0)
        )[:, j]
        rotor = sum(
            float(c[0])
            for term, c in model.effect_coefficients_.items()
            if term.kind == "rotor_inertia" and term.places == (j,)
        )
        return JointLoop.of(self.task, j, link + rotor, rigid - link * ddq[:, j], rigid)


def _encoder_noise(robot: Any, X: Any, smooth: Array) -> Array:
    """Noise removed from the logged positions by smoothing, rad or m, shape (n_joints,)."""
    names = names_of_table(X)
    columns = resolve_columns(names, len(names), robot.joint_names, require_acceleration=False)
    logged = np.column_stack([np.asarray(X[names[k]], dtype=float) for k in columns.q])
    return np.asarray(np.std(logged - smooth, axis=0))


def _name(joint: _Joint) -> _Answer | None:
    """The effect that explains the motion of a joint, if one does."""
    loop, plain = joint.loop, joint.plain
    start = {**joint.start, **plain.values}
    tried = rivals_of(loop, joint.kinds)
    # All are fitted to one half; the best of each kind to the other half, too.
    fits = fit_all(loop, [{**joint.ranges, **law} for _, law in tried], start, (0,))
    first: dict[str, tuple[Fit, dict[str, Range]]] = {}
    for (kind, law), fit in zip(tried, fits, strict=True):
        if kind not in first or fit.mean < first[kind][0].mean:
            first[kind] = fit, law
    ranking = sorted(first, key=lambda kind: first[kind][0].mean)
    odd = np.isfinite(first[ranking[0]][0].left_out)
    least = SECOND_DROP if joint.kinds else LEAST_DROP
    if first[ranking[0]][0].mean > (1 - least / 2) * float(plain.left_out[odd].mean()):
        return None
    ranking = ranking[:2]
    both = fit_all(loop, [{**joint.ranges, **first[kind][1]} for kind in ranking], start)
    whole = dict(zip(ranking, both, strict=True))
    best, other = sorted(whole, key=lambda kind: whole[kind].mean)
    drops = [1.0 - whole[kind].mean / plain.mean for kind in (best, other)]
    if drops[0] - drops[1] < MARGIN * drops[0]:
        if (best, other) != ("backlash", "joint_elasticity"):
            return None
        best, other = other, best  # a gear with play is elastic, too; one without is simpler
    if 1.0 - whole[best].mean / plain.mean < least:
        return None
    if float(np.mean(whole[best].left_out < plain.left_out)) <= LEAST_PIECES:
        return None
    before, after, beside = (float(np.sqrt(fit.mean)) for fit in (plain, whole[best], whole[other]))
    # the error of the command as a prediction of the position
    if not after < NEARER * float(np.sqrt(np.mean((loop.command - loop.q)[loop.valid] ** 2))):
        return None
    values, ranges = whole[best].values, {**joint.ranges, **first[best][1]}
    halves = halves_told(best, values, *covariance(loop, ranges, values))
    finding = ServoFinding(
        best,
        joint.index + 1,
        sizes_told(best, values),
        before,
        after,
        other,
        beside,
        halves=halves,
    )
    return _Answer(finding, whole[best], first[best][1])


def _given(model: Any, joint: int) -> dict[str, float]:
    """Viscous and dry friction of the model, as initial values of the fit."""
    return {
        term.kind: float(c[0])
        for term, c in model.effect_coefficients_.items()
        if term.kind in ("viscous", "coulomb") and term.places == (joint,)
    }
