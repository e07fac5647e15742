# SPDX-License-Identifier: BSD-3-Clause
r"""One joint in its servo loop, for many sets of parameters at once.

A position servo keeps its joint so close to the logged motion that the logged motion can be used
for the other joints. This leaves one equation for the motor, and a second one for the link if the
gear is compliant or has play:

.. math:: J \dot v = \mathrm{servo}(q, v) - F_v v + \tau_0 - f - T, \qquad
          (M - J) \dot w = T - b(t)

with the torque :math:`T` of the gear, the inertia :math:`M` and the torque :math:`b` that the link
needs in addition to that of its acceleration, both along the logged motion, and dry friction
:math:`f`, which keeps the joint at rest where it can. Steps are trapezoidal; dry friction is
implicit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from skidyn._signals import Array
from skidyn.forward._run import Task

#: Longest step, s.
STEP = 5e-3
#: Share of the largest torque above which the servo may be at its limit: it no longer controls the
#: joint, which is reset to the log there. The errors of this many seconds after the start or a
#: reset do not count.
AT_LIMIT, SETTLING = 0.97, 0.25
#: Least share of the inertia that belongs to the link and not to its motor.
LEAST_LINK = 0.05
#: Damping ratio of a gear without damping of its own.
USUAL_DAMPING = 0.05
#: Added to divisors, which must not be zero.
TINY = 1e-12
#: Error, rad or m, above which a motion counts as lost.
LOST = 1.0

_ALL = (
    "viscous", "coulomb", "offset", "inertia", "weight", "dF", "vs", "mu", "dFc", "square",
    "presliding", "late", "compliance", "damping", "gap", "motor", "deadband",
)  # fmt: skip


@dataclass
class JointLoop:
    """A joint with its servo along pieces of a log.

    Attributes
    ----------
    q : ndarray of shape (n_samples, n_pieces)
        Logged positions, rad or m.
    valid : ndarray of shape (n_samples, n_pieces) of bool
        Samples whose error counts.
    inertia : ndarray of shape (n_samples, n_pieces)
        Inertia of everything that moves with the joint, kg m^2 or kg.
    """

    q: Array
    dq: Array
    time: Array
    valid: NDArray[np.bool_]
    held: NDArray[np.bool_]
    command: Array
    rate: Array
    inertia: Array
    bias: Array
    load: Array
    torque: Array
    stiffness: float
    damping: float
    limit: float
    fall: float
    deadband: float
    delay: float

    @classmethod
    def of(cls, task: Task, joint: int, inertia: Array, bias: Array, load: Array) -> JointLoop:
        """Loop of a joint, from 0, along pieces of a log with a controller.

        Arrays of shape (n_log,) are the inertia of motor and link, torque in addition to that of
        this inertia, and torque of the rigid body.
        """
        controller, windows, signals = task.controller, task.windows, task.signals
        assert controller is not None and task.reference is not None and task.rate is not None
        wanted, rate = task.reference[:, joint], task.rate[:, joint]
        if not controller.follows_velocity:
            rate = np.zeros_like(rate)
        gains = [float(np.atleast_1d(getattr(controller, name))[joint]) for name in
                 ("stiffness", "damping", "limit", "fall", "deadband", "offset")]  # fmt: skip
        stiffness, damping, limit, fall, deadband, offset = gains
        q, dq = signals.q[:, joint], signals.dq[:, joint]
        # The limit is found from the log, with the command as received by the servo.
        arrived = wanted.copy()
        for own in signals.segments:
            clock = signals.clock[own]
            arrived[own] = np.interp(clock - controller.delay, clock, wanted[own])
        torque = stiffness * (arrived - q) + damping * (rate - dq)
        beyond = np.abs(torque + fall * dq) > AT_LIMIT * limit
        torque = np.clip(torque, -limit - fall * dq, limit - fall * dq)
        rows = windows.rows
        beyond = maximum_filter1d(beyond[rows].T.astype(np.uint8), 5, axis=0) > 0
        steps = np.diff(windows.time, axis=1)
        wait = max(1, round(SETTLING / float(np.median(steps))))
        after = beyond.copy()
        for k in range(1, wait + 1):
            after[k:] |= beyond[:-k]
        valid = windows.valid.T & ~after
        valid[:wait] = False

        def along(values: Array) -> Array:
            return np.ascontiguousarray(values[rows].T)

        return cls(
            q=along(q),
            dq=along(dq),
            time=windows.time.T,
            valid=valid,
            held=beyond,
            command=along(wanted),
            rate=along(rate),
            inertia=along(inertia),
            bias=along(bias - offset),
            load=along(load),
            torque=along(torque),
            stiffness=stiffness,
            damping=damping,
            limit=limit,
            fall=fall,
            deadband=deadband,
            delay=float(controller.delay),
        )

    def only(self, pieces: NDArray[np.int64]) -> JointLoop:
        """Loop with some of the pieces."""
        tables: dict[str, Any] = {
            k: v[:, pieces] for k, v in vars(self).items() if isinstance(v, np.ndarray)
        }
        return replace(self, **tables)

    @property
    def size(self) -> float:
        """Usual inertia, kg m^2 or kg."""
        return float(np.median(self.inertia))

    def errors(self, parameters: Mapping[str, Array]) -> Array:
        """Simulated minus logged positions, shape (n_models, n_samples, n_pieces), rad or m."""
        error = self.run(parameters) - self.q
        error = np.clip(np.where(np.isfinite(error), error, LOST), -LOST, LOST)
        return np.asarray(error * self.valid)

    def run(self, parameters: Mapping[str, Array]) -> Array:
        """Positions of the motor.

        Parameters
        ----------
        parameters : dict of str to ndarray of shape (n_models,)
            ``viscous``, ``coulomb``, ``offset`` in N m and s/rad (N, m); ``inertia`` and
            ``weight``, by which inertia and torque of the link are larger than given, as a share.
            Of effects: ``dF`` and ``vs`` (Stribeck), ``mu`` (load), ``dFc`` (direction), ``square``
            (viscous friction that grows with the speed), ``presliding`` (stiffness of a Dahl
            model), ``late`` (s); ``compliance`` and ``damping`` (ratio) of the gear, ``gap`` (half
            of its play), with ``motor``, the share of the inertia that is the motor's. Of the
            servo: ``deadband`` (rad, m) in addition to the given one.

        Returns
        -------
        ndarray of shape (n_models, n_samples, n_pieces)
        """
        return self._run(parameters)[0]

    def twist(self, parameters: Mapping[str, float]) -> Array:
        """Motor minus link along a simulation of a gear, shape (n_samples, n_pieces), rad or m.

        Parameters are those of :meth:`run`, with ``compliance``.
        """
        return np.asarray(self._run({k: np.array([v]) for k, v in parameters.items()})[1][0])

    def _run(self, parameters: Mapping[str, Array]) -> tuple[Array, Array]:
        """Positions of the motor, and lag of the link behind it; empty without a gear."""
        joint = _Joint(
            self, {k: np.asarray(v, dtype=float)[:, None] for k, v in parameters.items()}
        )
        gear = joint.gear
        result = np.empty((len(self.q), *joint.q.shape))
        behind = np.empty(result.shape if gear is not None else (0, len(joint.q), 0))
        held = np.asarray(self.held.any(axis=1))
        parts = np.ceil(np.diff(self.time, axis=0).max(axis=1) / STEP - 1e-9).astype(int)
        for i in range(len(self.q)):
            if held[i]:
                joint.reset(i)
            result[i] = joint.q
            if gear is not None:
                behind[i] = joint.q - gear.y
            if i < len(parts):
                joint.advance(i, max(1, int(parts[i])))
        return np.moveaxis(result, 0, 1), np.moveaxis(behind, 0, 1)


class _Joint:
    """Position and velocity of the motor in all models and pieces, shape (n_models, n_pieces)."""

    def __init__(self, loop: JointLoop, given: Mapping[str, Array]) -> None:
        n_models = len(next(iter(given.values())))
        p = {k: given.get(k, np.zeros((n_models, 1))) for k in _ALL}
        self.loop, self.p = loop, p
        self.command = _Command(loop, loop.delay + p["late"][:, 0])
        self.servo, self.dry = _Servo(loop, p), _Dry(loop, p)
        self.limited, self.dahl = bool(np.isfinite(loop.limit)), "presliding" in given
        self.more, self.heavier = p["inertia"] * loop.size, 1 + p["weight"]
        self.offset, self.squares = 2 * p["offset"], bool(p["square"].any())
        self.brake = np.maximum(p["coulomb"], TINY)
        self.q, self.v = (np.tile(x[0], (n_models, 1)) for x in (loop.q, loop.dq))
        self.bent = np.sign(self.v) * p["coulomb"]
        self.gear = _Gear(loop, p) if "compliance" in given else None
        if self.gear is not None:
            self.gear.hang(0, self.q, self.v, True)

    def reset(self, i: int) -> None:
        """Return to the log in the pieces whose servo may be at its limit at a sample."""
        back: NDArray[np.bool_] = self.loop.held[i]
        self.q = np.where(back, self.loop.q[i], self.q)
        self.v = np.where(back, self.loop.dq[i], self.v)
        self.bent = np.where(back, np.sign(self.v) * self.p["coulomb"], self.bent)
        if self.gear is not None:
            self.gear.hang(i, self.q, self.v, back)

    def advance(self, i: int, n_parts: int) -> None:
        """Move from a sample to the next in some steps."""
        loop = self.loop
        h = (loop.time[i + 1] - loop.time[i]) / n_parts
        after, bias1 = self.command.at(i, 0.0), loop.bias[i]
        for part in range(n_parts):
            a, b = part / n_parts, (part + 1) / n_parts
            before, after = after, self.command.at(i, b)
            bias0, bias1 = bias1, _between(loop.bias, i, b)
            m = _between(loop.inertia, i, a) + self.more
            self._step(i, h, m, self.heavier * (bias0 + bias1), before, after)

    def _step(
        self,
        i: int,
        h: Array,
        m: Array,
        bias: Array,
        before: tuple[Array, Array],
        after: tuple[Array, Array],
    ) -> None:
        """Move for ``h`` s, with the commands before and after it; ``bias`` is the sum of both."""
        half, v = h / 2, self.v
        push, mass = self._push(half, m, bias, before)
        if self.dahl:
            dry: Any = 0.0
            yields = 1 - self.bent * np.sign(v) / self.brake
            push = push - h * self.bent
            mass = mass + h * half * self.p["presliding"] * np.maximum(yields, 0.0)
        else:
            dry = h * self.dry.level(i, v, after[0] - self.q)
        new = self._new_velocity(half, push, mass, dry, after)
        if self.gear is not None:
            self.gear.move(half, new)
        way = half * (v + new)
        if self.dahl:
            turn = np.abs(way) * self.bent / self.brake
            bent = self.bent + self.p["presliding"] * (way - turn)
            self.bent = np.clip(bent, -self.p["coulomb"], self.p["coulomb"])
        self.q, self.v = self.q + way, new

    def _push(
        self, half: Array, m: Array, bias: Array, command: tuple[Array, Array]
    ) -> tuple[Array, Array]:
        """Impulse and mass without dry friction and the servo at the end of the step."""
        p, v, loop = self.p, self.v, self.loop
        drag = p["viscous"] + p["square"] * np.abs(v) if self.squares else p["viscous"]
        servo = self.servo.torque(command[0] - self.q) + loop.damping * (command[1] - v)
        if self.limited:
            limit, slower = loop.limit, loop.fall * v
            servo = np.minimum(np.maximum(servo, -limit - slower), limit - slower)
        drive = servo - drag * v + self.offset
        if self.gear is None:
            return m * v + half * (drive - bias), m + half * drag
        push, mass = self.gear.push(half, self.q, v, m, bias)
        return push + half * drive, mass + half * drag

    def _new_velocity(
        self, half: Array, push: Array, mass: Array, dry: Any, command: tuple[Array, Array]
    ) -> Array:
        """Velocity of the motor at the end of a step."""
        (r1, d1), damping, limit = command, self.loop.damping, self.loop.limit
        # The servo at the end of the step, without its damping and without the motion until then.
        error = r1 - self.q - half * self.v
        pull = push + half * (self.servo.torque(error) + damping * d1)
        stiffer = half * (damping + half * self.servo.slope(error))
        new = _held(pull, dry) / (mass + stiffer)
        if self.limited:
            servo = self.servo.torque(error - half * new) + damping * (d1 - new)
            beyond = np.abs(servo + self.loop.fall * new) > limit
            if beyond.any():
                most = np.clip(servo, -limit, limit)
                slower = mass + half * self.loop.fall
                new = np.where(beyond, _held(push + half * most, dry) / slower, new)
        return np.asarray(new)


def _between(values: Array, i: int, share: float) -> Array:
    """Values interpolated between sample i and the next."""
    return np.asarray((1 - share) * values[i] + share * values[i + 1])


class _Dry:
    """Level of dry friction."""

    def __init__(self, loop: JointLoop, p: Mapping[str, Array]) -> None:
        self.p, self.load = p, np.abs(loop.load)
        self.fast = np.maximum(p["vs"], TINY)
        self.sticks, self.leans = bool(p["dF"].any()), bool(p["dFc"].any())
        self.loaded = bool(p["mu"].any())

    def level(self, i: int, v: Array, ahead: Array) -> Array:
        """Level at a sample; at rest its direction is that of the servo's torque."""
        level = self.p["coulomb"]
        if self.loaded:
            level = level + self.p["mu"] * self.load[i]
        if self.sticks:
            level = level + self.p["dF"] * np.exp(-((v / self.fast) ** 2))
        if self.leans:
            level = level + self.p["dFc"] * np.sign(np.where(v == 0, ahead, v))
        return np.maximum(level, 0.0)


class _Servo:
    """Gain and deadband of the servo."""

    def __init__(self, loop: JointLoop, p: Mapping[str, Array]) -> None:
        self.gain, self.band = loop.stiffness, loop.deadband + p["deadband"]
        self.any_band = bool(self.band.any())

    def torque(self, error: Array) -> Array:
        """Torque of an error of position, without damping."""
        if self.any_band:
            error = np.sign(error) * np.maximum(np.abs(error) - self.band, 0.0)
        return self.gain * error

    def slope(self, error: Array) -> Any:
        """Decrease of the torque per unit of motion of the joint."""
        return self.gain * (np.abs(error) >= self.band) if self.any_band else self.gain


class _Gear:
    """A gear with a spring and play, and the link behind it."""

    def __init__(self, loop: JointLoop, p: Mapping[str, Array]) -> None:
        self.loop, self.gap, self.weight = loop, p["gap"], 1 + p["weight"]
        self.motor = p["motor"] * loop.size
        self.spring = 1.0 / np.maximum(p["compliance"], TINY)
        ratio = np.where(p["damping"] > 0, p["damping"], USUAL_DAMPING)
        self.damper = 2.0 * ratio * np.sqrt(self.spring * self.motor)
        shape = (len(self.gap), loop.q.shape[1])
        self.y, self.w = np.zeros(shape), np.zeros(shape)

    def hang(self, i: int, q: Array, v: Array, where: Any) -> None:
        """Set the link in static equilibrium on its gear under the load of a sample."""
        load = self.weight * self.loop.bias[i]
        y = q - load / self.spring - np.sign(load) * self.gap
        self.y, self.w = np.where(where, y, self.y), np.where(where, v, self.w)

    def push(self, half: Array, q: Array, v: Array, m: Array, bias: Array) -> tuple[Array, Array]:
        """Impulse and mass of the motor alone and with the gear, the link eliminated."""
        link = np.maximum(m - self.motor, LEAST_LINK * m)
        twist, rate = q - self.y, v - self.w
        ahead = twist + 2 * half * rate
        on = (np.abs(ahead) >= self.gap) * 1.0
        side = np.sign(ahead) * self.gap
        before = on * (self.spring * (twist - side) + self.damper * rate)
        now = on * self.spring * (twist + half * rate - side)
        self.stiff = on * (self.spring * half + self.damper)
        self.heavy = link + half * self.stiff
        self.way_on = link * self.w + half * (before + now - bias)
        push = self.motor * v - half * (before + now - self.stiff * self.way_on / self.heavy)
        return push, self.motor + half * self.stiff * (1 - half * self.stiff / self.heavy)

    def move(self, half: Array, new: Array) -> None:
        """Move the link according to the motor's new velocity."""
        moved = (self.way_on + half * self.stiff * new) / self.heavy
        self.y, self.w = self.y + half * (self.w + moved), moved


def _held(push: Array, dry: Array) -> Array:
    """Remainder of an impulse after dry friction; zero where friction holds the joint."""
    return np.asarray(np.sign(push) * np.maximum(np.abs(push) - dry, 0.0))


class _Command:
    """Command and its velocity between samples, as received by the servo."""

    def __init__(self, loop: JointLoop, late: Array) -> None:
        self.loop = loop
        self.late = late
        self.shifted = bool(np.any(late))
        if self.shifted:
            n_samples, n_pieces = loop.q.shape
            self.command = np.empty((n_samples, len(late), n_pieces))
            self.rate = np.zeros((n_samples, 1, 1))
            moves = bool(loop.rate.any())
            if moves:
                self.rate = np.empty_like(self.command)
            lags = np.unique(late)
            models = [np.flatnonzero(late == lag) for lag in lags]
            for k in range(n_pieces):
                time = loop.time[:, k]
                for lag, same in zip(lags, models, strict=True):
                    wanted = np.interp(time - lag, time, loop.command[:, k])
                    self.command[:, same, k] = wanted[:, None]
                    if moves:
                        rate = np.interp(time - lag, time, loop.rate[:, k])
                        self.rate[:, same, k] = rate[:, None]
        else:
            self.command, self.rate = loop.command[:, None], loop.rate[:, None]

    def at(self, i: int, share: float) -> tuple[Array, Array]:
        """Command and its velocity interpolated between sample i and the next."""
        wanted, rate = self.command, self.rate
        return (
            wanted[i] + share * (wanted[i + 1] - wanted[i]),
            rate[i] + share * (rate[i + 1] - rate[i]),
        )
