# SPDX-License-Identifier: BSD-3-Clause
"""Effects named by the motion of servos: what brings simulated motion to the logged one.

The torque that accelerates a link is known from positions that were differentiated twice, with all
their noise. An effect that lasts hundredths of a second drowns in it, while the motion that it
causes stands far above the noise of the encoder. So each joint is simulated in its loop, others as
logged, with its friction alone and with one effect more; what is fitted to half of the pieces is
judged on the other half.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np

from skidyn._columns import names_of_table, resolve_columns
from skidyn._exceptions import LogError, SkidynError
from skidyn._progress import track
from skidyn._signals import Array
from skidyn._text import inside, measure
from skidyn.effects import get_effect
from skidyn.forward import Controller, JointLoop, Task, read_task

#: Length of a piece, s, and fewest pieces.
PIECE, FEWEST_PIECES = 6.0, 4
#: Steps of a fit at most, the fall of the squared error that ends it, dampings tried at once.
ROUNDS, SMALL = 10, 3e-3
DAMPING = (0.0, 1e-3, 1e-2, 0.1, 1.0, 10.0)
#: Times the noise of the positions, and least noise, rad or m, above which something is missing.
STANDS_OUT, SMALLEST = 2.5, 2e-5
#: Share of the squared error that a finding must remove, held out, and more than that
#: share of the pieces on which it must help.
LEAST_DROP, LEAST_PIECES = 0.3, 0.5
#: The simulation with the finding must err by less than this share of what the command itself errs.
NEARER = 0.5
#: Half of a play, as share of the way, from which a second fit starts.
FARTHER = 0.02
#: The best other explanation must leave so much of that to it.
MARGIN = 0.15


@dataclass(frozen=True)
class ServoFinding:
    """An effect without which the motion of a servo cannot be simulated.

    Parameters
    ----------
    kind : str
        Kind of the catalogue.
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

    @property
    def title(self) -> str:
        """The effect in words."""
        return get_effect(self.kind).title

    @property
    def size(self) -> str:
        """Its parameters with their units."""
        units = get_effect(self.kind).units(self.unit == "m")
        return ", ".join(measure(k, v, units.get(k, "")) for k, v in self.parameters.items())

    @property
    def sentence(self) -> str:
        """In words."""
        return f"{self.title} of joint {self.joint} ({self.size}): {self.evidence}."

    @property
    def evidence(self) -> str:
        """What it does to the simulated motion, and what the next best explanation does."""
        before, after, beside = (
            f"{1e3 * error:.3g}" for error in (self.before, self.after, self.beside)
        )
        said = f"the simulated motion errs by {after} in place of {before} m{self.unit}"
        if self.beside >= self.before:
            return f"{said}; no other effect lowers that"
        return f"{said}; with {inside(get_effect(self.rival).title)} it would be {beside}"

    def to_dict(self) -> dict[str, Any]:
        """As in the report of a diagnosis.

        Returns
        -------
        dict
            The parameters above, and ``sentence``.
        """
        return {**asdict(self), "sentence": self.sentence}

    def __str__(self) -> str:
        return self.sentence


def explain_servo_motion(
    model: Any,
    X: Any,
    controller: Controller,
    *,
    joints: Sequence[int] | None = None,
) -> list[ServoFinding]:
    """Name what the motion of position servos lacks in a simulation.

    Every joint is simulated along its command, with the bodies and rotor inertias of the model,
    the other joints as logged, and viscous and dry friction fitted to the motion. Where this errs
    by more than the positions are noisy, stiction, friction with the load, with the
    direction, or with the square of the speed, presliding, delay, elasticity and backlash compete.
    Each is fitted to half of the pieces of the log and judged on the others. One effect is named,
    that which removes the largest share of the squared error: a link that moves by itself is felt
    by other joints. Nothing is named where the simulation errs by half as much as the command
    itself, or more: then the gains are wrong, or the bodies.

    Parameters
    ----------
    model : RBDRegressor
        Fitted to the servo's torque (:func:`servo_torque`).
    X : DataFrame
        ``time`` (s), ``q1..``, ``dq1..`` (rad, m; rad/s, m/s), commands ``q_ref1..`` or ``cmd1..``,
        and ``trajectory`` if there are several recordings; at least four pieces of 3 s.
    controller : Controller
        Gains, delay and limit of the servos.
    joints : sequence of int, optional
        Joints, counted from 1, that may get a name; all by default.

    Returns
    -------
    list of ServoFinding
        One or none.

    Raises
    ------
    SkidynError
        A column is missing.
    LogError
        The log is too short.

    See Also
    --------
    skidyn.diagnosis.diagnose : What the servo's torque lacks.

    Examples
    --------
    >>> from skidyn.simulation import explain_servo_motion
    >>> found = explain_servo_motion(model, log, servo)  # doctest: +SKIP
    >>> print(found[0].sentence)  # doctest: +SKIP
    """
    n = model.robot_.n_joints
    wanted = range(1, n + 1) if joints is None else joints
    strange = [j for j in wanted if not 1 <= j <= n]
    if strange:
        raise SkidynError(f"joints={list(wanted)}; the robot has joints 1 to {n}")
    task = read_task(model, X, None, controller, PIECE)
    pieces = len(task.windows.rows)
    if pieces < FEWEST_PIECES:
        raise LogError(
            f"the log holds {pieces} piece(s) of {PIECE:g} s; effects are judged on pieces left "
            f"out, which takes {FEWEST_PIECES}"
        )
    loops = _loops(model, task)
    plain = [
        _fit(loop, _FRICTION, _given(model, j))
        for j, loop in enumerate(track(loops, "Simulating the servos"))
    ]
    errors = np.sqrt([_mean(fit) for fit in plain])
    least = STANDS_OUT * np.maximum(_encoder_noise(model.robot_, X, task.signals.q), SMALLEST)
    failing = [j - 1 for j in wanted if errors[j - 1] > least[j - 1]]
    found = [_name(loops[j], plain[j], j + 1) for j in track(failing, "Comparing effects")]
    slides = [kind == "prismatic" for kind in model.robot_.joint_types]
    named = [
        replace(f, unit="m" if slides[f.joint - 1] else "rad")
        for f in found
        if f is not None and f.after < NEARER * _command_error(loops[f.joint - 1])
    ]
    return sorted(named, key=lambda f: f.after / f.before)[:1]


def _encoder_noise(robot: Any, X: Any, smooth: Array) -> Array:
    """What smoothing takes from the logged positions, rad or m, shape (n_joints,)."""
    names = names_of_table(X)
    columns = resolve_columns(names, len(names), robot.joint_names, require_acceleration=False)
    logged = np.column_stack([np.asarray(X[names[k]], dtype=float) for k in columns.q])
    return np.asarray(np.std(logged - smooth, axis=0))


def _command_error(loop: JointLoop) -> float:
    """Error of the command as a prediction of the position."""
    return float(np.sqrt(np.mean((loop.command - loop.q)[loop.valid] ** 2)))


def _name(loop: JointLoop, plain: _Fit, joint: int) -> ServoFinding | None:
    """The effect that explains the motion of a joint, if one does."""
    tried = [(kind, {**_FRICTION, **law}) for kind, law in _LAWS.items()]
    play = {**_FRICTION, **_LAWS["backlash"]}
    tried.append(("backlash", {**play, "gap": replace(play["gap"], start=FARTHER)}))
    # All are fitted to one half; the best of each kind to the other half, too.
    first: dict[str, tuple[_Fit, dict[str, _Range]]] = {}
    for kind, ranges in tried:
        fit = _fit(loop, ranges, plain, (0,))
        if kind not in first or _mean(fit) < _mean(first[kind][0]):
            first[kind] = fit, ranges
    ranking = sorted(first, key=lambda kind: _mean(first[kind][0]))
    odd = np.isfinite(first[ranking[0]][0].left_out)
    if _mean(first[ranking[0]][0]) > (1 - LEAST_DROP / 2) * float(plain.left_out[odd].mean()):
        return None
    fits = {kind: _fit(loop, first[kind][1], plain) for kind in ranking[:2]}
    ranking = sorted(fits, key=lambda kind: _mean(fits[kind]))
    drops = [1.0 - _mean(fits[kind]) / _mean(plain) for kind in ranking]
    best, other = ranking
    if drops[0] - drops[1] < MARGIN * drops[0]:
        if ranking != ["backlash", "joint_elasticity"]:
            return None
        best, other = other, best  # a gear with play is elastic, too; without is simpler
    before, after = plain.left_out, fits[best].left_out
    if 1.0 - _mean(fits[best]) / _mean(plain) < LEAST_DROP:
        return None
    if float(np.mean(after < before)) <= LEAST_PIECES:
        return None
    sizes = [float(np.sqrt(_mean(fit))) for fit in (plain, fits[best], fits[other])]
    said = _said(best, fits[best].values)
    return ServoFinding(best, joint, said, sizes[0], sizes[1], other, sizes[2])


@dataclass(frozen=True)
class _Range:
    """Start, limits and size of a parameter, in units of :func:`_units`."""

    start: float
    low: float
    high: float
    size: float
    unit: str = "one"


_FRICTION = {
    "viscous": _Range(0.5, -5.0, 20.0, 1.0, "drag"),
    "coulomb": _Range(1.0, 0.0, 10.0, 1.0, "friction"),
    "offset": _Range(0.0, -5.0, 5.0, 1.0, "friction"),
    "inertia": _Range(0.0, -0.6, 1.0, 0.1),
    "weight": _Range(0.0, -0.5, 0.5, 0.1),
}
_MOTOR = _Range(0.2, 0.02, 0.9, 0.1)
_LAWS: dict[str, dict[str, _Range]] = {
    "stribeck": {
        "dF": _Range(0.5, 0.0, 10.0, 1.0, "friction"),
        "vs": _Range(0.08, 0.01, 1.0, 0.1, "speed"),
    },
    "load_dependent_friction": {"mu": _Range(0.1, 0.0, 1.0, 0.1)},
    "dahl": {"presliding": _Range(100.0, 5.0, 5e3, 100.0, "presliding")},
    "time_delay": {"late": _Range(0.01, 0.0, 0.05, 0.01)},
    "asymmetric_friction": {"dFc": _Range(0.0, -5.0, 5.0, 1.0, "friction")},
    "nonlinear_viscous": {"square": _Range(0.0, -5.0, 5.0, 1.0, "square")},
    "joint_elasticity": {
        "compliance": _Range(1.2e-3, 1e-5, 0.2, 4e-4, "compliance"),
        "damping": _Range(0.1, 0.0, 1.0, 0.1),
        "motor": _MOTOR,
    },
    "backlash": {
        "gap": _Range(0.006, 0.0, 0.1, 0.005, "way"),
        "compliance": _Range(5e-4, 1e-5, 1e-2, 3e-4, "compliance"),
        "motor": _MOTOR,
    },
}


def _units(loop: JointLoop) -> dict[str, float]:
    """What counts as one: a part of the joint's torque, its way, its speed."""
    seen = loop.valid
    torque = 0.05 * float(np.sqrt(np.mean(loop.torque[seen] ** 2))) + 1e-12
    speed = float(np.std(loop.dq[seen])) + 1e-9
    return {
        "one": 1.0,
        "friction": torque,
        "drag": torque / speed,
        "square": torque / speed**2,
        "presliding": torque / (float(np.std(loop.q[seen])) + 1e-9),
        "compliance": 1.0 / loop.size,
        "speed": speed,
        "way": float(np.std(loop.q[seen])) + 1e-9,
    }


@dataclass(frozen=True)
class _Fit:
    """Values of the parameters, and mean squared error of every piece, held out."""

    values: dict[str, float]
    left_out: Array


def _fit(
    loop: JointLoop, ranges: dict[str, _Range], plain: _Fit, parts: Sequence[int] = (0, 1)
) -> _Fit:
    """Fit to half of the pieces, judge on the other, and the other way round."""
    units = _units(loop)
    scale = np.array([units[r.unit] for r in ranges.values()])
    table = np.array([(r.start, r.low, r.high, r.size) for r in ranges.values()]).T * scale
    start, low, high, size = table
    names = list(ranges)
    known = [names.index(k) for k in plain.values]
    start[known] = list(plain.values.values())
    count = loop.q.shape[1]
    halves = [np.arange(k, count, 2) for k in range(2)]
    found = []
    for k in parts:
        start = _search(loop.only(halves[k]), names, start, low, high, size)
        found.append(start)
    left = np.full(count, np.nan)
    for theta, k in zip(found, parts, strict=True):
        other = halves[1 - k]
        rest = loop.only(other)
        error = rest.errors({k: theta[[i]] for i, k in enumerate(names)})[0]
        left[other] = (error**2).sum(axis=0) / np.maximum(rest.valid.sum(axis=0), 1)
    return _Fit(dict(zip(names, map(float, np.mean(found, axis=0)), strict=True)), left)


def _mean(fit: _Fit) -> float:
    return float(np.nanmean(fit.left_out))


def _search(
    loop: JointLoop, names: list[str], x: Array, low: Array, high: Array, size: Array
) -> Array:
    """Damped Gauss-Newton steps within limits; all models of a step are simulated together."""

    def errors(thetas: Array) -> Array:
        found = loop.errors({k: thetas[:, i] for i, k in enumerate(names)})
        return found.reshape(len(thetas), -1)

    x = np.clip(x, low, high)
    for _ in range(ROUNDS):
        step = np.where(x + 1e-2 * size > high, -1e-2, 1e-2) * size
        here = errors(np.vstack([x, x + np.diag(step)]))
        slope = (here[1:] - here[0]) / (step / size)[:, None]
        cost = float(here[0] @ here[0])
        gram, along = slope @ slope.T, slope @ here[0]
        floor = 1e-9 * np.trace(gram) * np.eye(len(x)) + np.finfo(float).tiny * np.eye(len(x))
        tried = np.array(
            [
                np.clip(
                    x - size * np.linalg.solve(gram + d * np.diag(np.diag(gram)) + floor, along),
                    low,
                    high,
                )
                for d in DAMPING
            ]
        )
        costs = (errors(tried) ** 2).sum(axis=1)
        best = int(np.argmin(costs))
        if not costs[best] < cost:
            break
        x = tried[best]
        if costs[best] > (1 - SMALL) * cost:
            break
    return x


def _given(model: Any, joint: int) -> _Fit:
    """Viscous and dry friction of the model, where the fit starts."""
    values = {
        term.kind: float(c[0])
        for term, c in model.effect_coefficients_.items()
        if term.kind in ("viscous", "coulomb") and term.places == (joint,)
    }
    return _Fit(values, np.zeros(0))


def _said(kind: str, values: dict[str, float]) -> dict[str, float]:
    """Sizes of an effect as its catalogue calls them."""
    if kind == "backlash":
        return {"gap": 2 * values["gap"]}
    if kind == "dahl":  # the catalogue calls the way so
        return {"presliding": values["coulomb"] / values["presliding"]}
    if kind == "joint_elasticity":
        return {"K": 1.0 / values["compliance"]}
    if kind == "nonlinear_viscous":
        return {"c": values["square"], "power": 2.0}
    names = {"late": "delay"}
    own = [k for k in _LAWS[kind] if k not in ("motor", "damping")]
    return {names.get(k, k): values[k] for k in own}


def _loops(model: Any, task: Task) -> list[JointLoop]:
    """Every joint in its loop, with bodies and rotor inertias of the model."""
    robot, signals = model.robot_, task.signals
    bodies = model.inertial_parameters_
    rigid = robot.inverse_dynamics(signals.q, signals.dq, signals.ddq, parameters=bodies)
    still = np.zeros_like(signals.dq)
    loops = []
    for j in range(robot.n_joints):
        turn = np.zeros_like(signals.ddq)
        turn[:, j] = 1.0
        link = robot.inverse_dynamics(
            signals.q, still, turn, parameters=bodies, gravity=(0.0, 0.0, 0.0)
        )[:, j]
        rotor = sum(
            float(c[0])
            for term, c in model.effect_coefficients_.items()
            if term.kind == "rotor_inertia" and term.places == (j,)
        )
        bias = rigid[:, j] - link * signals.ddq[:, j]
        loops.append(JointLoop.of(task, j, link + rotor, bias, rigid[:, j]))
    return loops
