# SPDX-License-Identifier: BSD-3-Clause
"""A fitted model for simulation: the direction of dry friction is an input.

The model's own code is run on symbols, with the direction of motion of every joint and the states
of hysteresis as inputs in addition to q, dq and ddq. Everything that the direction multiplies is
dry friction, also in effects of users; so no list of kinds is needed here.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._exceptions import SkidynError
from skidyn._signals import Array, Signals
from skidyn.dynamics import BoundProgram, Program, Tape
from skidyn.effects import Law, PathMemory, Term, TermSum
from skidyn.robots import Instant, SymbolicRobot, Symbols, filled, symbols

#: Relative difference between rows that are evaluated together and one by one above which an effect
#: has a memory.
_ALIKE = 1e-9


@dataclass(frozen=True)
class _Moment(Instant):
    """One sample of symbols in which the direction of motion and hysteresis are given."""

    direction: Any = None
    states: Any = None

    @property
    def sign(self) -> Any:
        """Direction of motion, an input."""
        return self.direction


@dataclass(frozen=True)
class _Rows(Signals):
    """Independent samples with a given direction of motion."""

    direction: Any = None

    @property
    def sign(self) -> Any:
        """Direction of motion, an input."""
        return self.direction


@dataclass(frozen=True)
class Memory:
    """One state of hysteresis: the joint on whose path it depends, and its law."""

    joint: int
    law: Law


#: Largest argument of a hyperbolic sine; and damping ratio without load of a gear that becomes
#: stiffer, which its effect takes as quasi-static.
STIFFEST, DAMPING_OF_STIFFENING = 30.0, 0.2


@dataclass(frozen=True)
class Spring:
    """Elastic element between motor and link of a joint.

    Attributes
    ----------
    joint : int
        Joint, from 0.
    stiffness : float, N m/rad
        Stiffness of the gear, or of the flanks of a gap.
    damping : float, N m s/rad
        Damping in parallel.
    gap : float, rad
        Play between the flanks; 0 for none.
    stiffening : float, N m
        Torque from which the gear becomes stiffer; infinite if it does not.
    """

    joint: int
    stiffness: float
    damping: float
    gap: float = 0.0
    stiffening: float = np.inf

    def torque(self, twist: Array) -> Array:
        """Elastic torque, N m, if the motor is ahead of the link by a twist in rad."""
        bent = twist - np.clip(twist, -self.gap / 2, self.gap / 2)
        if np.isinf(self.stiffening):
            return np.asarray(self.stiffness * bent)
        ratio = np.clip(self.stiffness / self.stiffening * bent, -STIFFEST, STIFFEST)
        return np.asarray(self.stiffening * np.sinh(ratio))

    def twist(self, load: Array) -> Array:
        """How far the motor is ahead of the link under a load, rad."""
        bent = load / self.stiffness
        if np.isfinite(self.stiffening):
            bent = np.arcsinh(load / self.stiffening) * self.stiffening / self.stiffness
        return np.asarray(bent + np.sign(load) * self.gap / 2)


@dataclass
class Conditions:
    """Logged conditions of each sample other than its motion, one row each; None if not logged."""

    trajectory: NDArray[Any]
    time: Array
    temperature: Array | None = None

    def repeated(self, times: int) -> Conditions:
        """Several copies of all rows, one block after another."""
        temperature = None if self.temperature is None else np.tile(self.temperature, (times, 1))
        return Conditions(np.tile(self.trajectory, times), np.tile(self.time, times), temperature)


@dataclass
class ForwardModel:
    """Torque of a model as a function of motion, direction and hysteresis, many rows at once.

    Attributes
    ----------
    model : RBDRegressor
        Fitted model.
    memories : list of Memory
        States of hysteresis.
    springs : list of Spring
        Springs of the joints whose link has a separate coordinate.
    delay : ndarray of shape (n_joints,), s
        Delay of the logged torque.
    outside : list of Term
        Effects that are evaluated on numbers because they depend on recording, time or temperature.
    free : bool
        Whether inertial parameters and coefficients are also inputs, for many models at once.
    """

    model: Any
    free: bool = False
    memories: list[Memory] = field(default_factory=list)
    springs: list[Spring] = field(default_factory=list)
    outside: list[Term] = field(default_factory=list)

    def __post_init__(self) -> None:
        robot = self.model.robot_
        self.n = robot.n_joints
        self.sliding = np.array([kind == "prismatic" for kind in robot.joint_types])
        self.unit = np.where(self.sliding, 0.1, 1.0)
        self.delay = np.zeros(self.n)
        inside: list[Term] = []
        unknown: list[Term] = []
        for term in self.model.effect_terms_:
            if term.kind in _APART:
                _APART[term.kind](self, term)
            elif self._writes(term):
                inside.append(term)
            elif self._is_pointwise(term):
                self.outside.append(term)
            else:
                unknown.append(term)
        if unknown:
            names = ", ".join(map(str, unknown))
            raise SkidynError(
                f"{names}: depends on past samples in a way that cannot be continued step by "
                "step, and cannot be simulated; fit a model without it, or derive its class from "
                "PathMemory"
            )
        self.inside = inside
        self._program = self._traced(inside)
        self._bound: dict[tuple[int, int], BoundProgram] = {}
        self._theta: dict[tuple[int, int], Array] = {}

    # ------------------------------------------------------------------ what a model consists of
    def _writes(self, term: Term) -> bool:
        """Whether an effect is a function of motion, direction and hysteresis."""
        if {"trajectory", "trajectories"} & {k for k, v in term.shape.items() if v is not None}:
            return False
        try:
            self._traced([term])
        except Exception:  # any error of an effect given symbols: it cannot be recorded on a tape
            return False
        return True

    def _is_pointwise(self, term: Term) -> bool:
        """Whether the torque of a sample does not depend on the samples around it."""
        rng = np.random.default_rng(0)
        n_rows = 24
        q, dq, ddq = rng.normal(size=(3, n_rows, self.n))
        recording = term.shape.get("trajectory", 0)
        conditions = Conditions(
            np.full(n_rows, recording), np.linspace(0, 1, n_rows), rng.uniform(20, 40, q.shape)
        )
        together = self._outside_torque(q, dq, ddq, np.sign(dq), conditions, [term])
        order = rng.permutation(n_rows)
        mixed = Conditions(
            conditions.trajectory,
            conditions.time[order],
            conditions.temperature[order],  # type: ignore[index]
        )
        alone = self._outside_torque(
            q[order], dq[order], ddq[order], np.sign(dq[order]), mixed, [term]
        )
        scale = 1.0 + np.abs(together).max()
        return bool(np.abs(together[order] - alone).max() <= _ALIKE * scale)

    def _traced(self, terms: Sequence[Term]) -> Program:
        """Torques of the model (row 0) and of its rigid body (row 1) on a tape."""
        tape, n, model = Tape(), self.n, copy.copy(self.model)
        states: dict[Term, Any] = {}
        memories: list[Memory] = []
        for term in terms:
            effect = term.effect
            if isinstance(effect, PathMemory):
                laws = effect.laws(**term.shape)
                first = len(memories)
                memories += [Memory(term.places[0], law) for law in laws]
                states[term] = [
                    filled([tape.input("state", first + k)], (1,)) for k in range(len(laws))
                ]
        self.memories = memories
        model.effect_terms_ = list(terms)
        if self.free:
            model.effect_coefficients_ = {
                term: filled(
                    [tape.input("coef", i) for i in range(own.start, own.stop)], (term.width,)
                )
                for term, own in TermSum(terms).slices()
            }
        robot: Any = _StateRobot(self.model.robot_, tape, self.free, self.model)
        model.robot_ = robot
        q, dq, ddq, direction = (symbols(tape, name, n) for name in ("q", "dq", "ddq", "sign"))
        moment = _Moment(
            q,
            dq,
            ddq,
            np.zeros(1, dtype=int),
            prismatic=self.sliding,
            robot=robot,
            direction=direction,
            states=states,
        )
        torque = _model_torque(model, moment)[0]
        rigid = model.rigid_body_torque(q, dq, ddq)[0]
        outputs: dict[tuple[int, ...], Any] = {
            (0, j): tape.constant(0.0) + torque[j] for j in range(n)
        }
        outputs |= {(1, j): tape.constant(0.0) + rigid[j] for j in range(n)}
        return Program(tape, outputs, (2, n))

    # ------------------------------------------------------------------ numbers
    def torque(
        self,
        q: Array,
        dq: Array,
        ddq: Array,
        direction: Array,
        states: Array,
        conditions: Conditions,
        theta: tuple[Array, Array] | None = None,
    ) -> Array:
        """Torques of model and rigid body, shape (2, n_blocks, n_rows, n_joints).

        Motion has the shape (n_blocks, n_rows, n_joints), conditions and theta belong to the rows.
        """
        blocks, rows, n = q.shape
        key = blocks, rows
        if key not in self._bound:
            self._bound[key] = BoundProgram(self._program, blocks * rows, np.dtype(float))
        bound = self._bound[key]
        given = (("q", q), ("dq", dq), ("ddq", ddq), ("sign", direction), ("state", states))
        for name, values in given:
            buffer = bound.inputs.get(name)
            if buffer is not None:
                width = values.shape[2]
                buffer[:width] = values.reshape(-1, width).T[: len(buffer)]
        if theta is not None and self._theta.get(key) is not theta[0]:
            for name, values in (("phi", theta[0]), ("coef", theta[1])):
                buffer = bound.inputs.get(name)
                if buffer is not None:
                    buffer[...] = np.tile(values, (blocks, 1)).T[: len(buffer)]
            self._theta[key] = theta[0]
        for function, arguments in bound._calls:
            function(*arguments)
        result = bound.outputs.transpose(0, 2, 1).reshape(2, blocks, rows, n)
        if self.outside:
            flat = [x.reshape(-1, n) for x in (q, dq, ddq, direction)]
            more = self._outside_torque(
                flat[0], flat[1], flat[2], flat[3], conditions.repeated(blocks), self.outside
            )
            result = result.copy()
            result[0] += more.reshape(q.shape)
        return result

    def _outside_torque(
        self,
        q: Array,
        dq: Array,
        ddq: Array,
        direction: Array,
        conditions: Conditions,
        terms: Sequence[Term],
    ) -> Array:
        model = self.model
        # Motion that has diverged stays lost; an effect may raise an error for it.
        lost = np.asarray(~np.isfinite(np.column_stack([q, dq, ddq, direction])).all(axis=1))
        if lost.any():
            q, dq, ddq, direction = (
                np.where(lost[:, None], 0.0, x) for x in (q, dq, ddq, direction)
            )
        rigid = model.rigid_body_torque(q, dq, ddq)
        signals: Signals = _Rows(
            q,
            dq,
            ddq,
            conditions.trajectory,
            time=conditions.time,
            temperature=conditions.temperature,
            prismatic=self.sliding,
            robot=model.robot_,
            load=rigid,
            model_torque=rigid,
            smooth_torque=rigid,
            inertial_parameters=model.inertial_parameters_,
            direction=direction,
        )
        torque = np.zeros_like(q)
        for term in sorted(terms, key=lambda term: not term.effect.on_bodies):
            for j, block in term.torque_columns(signals).items():
                torque[:, j] += block @ model.effect_coefficients_[term]
            if term.effect.on_bodies:
                signals = signals.with_(load=rigid + torque)
        torque[lost] = np.nan
        return torque

    def starting_states(self, signals: Signals) -> Array:
        """States of hysteresis along the logged path, shape (n_samples, n_states)."""
        columns: list[Array] = []
        for term in self.inside:
            effect = term.effect
            if isinstance(effect, PathMemory):
                columns += effect.path_states(signals, term.places[0], **term.shape)
        return np.column_stack(columns) if columns else np.zeros((signals.n_samples, 0))

    # ------------------------------------------------------------------ many models at once
    def parameter_rows(self, parameters: Array, coefficients: Array) -> tuple[Array, Array]:
        """Inputs of a free model, one row per model: inertial parameters, then coefficients.

        Coefficients are those of the effects in :attr:`inside`, in this order.
        """
        canonical = self.model.robot_._engine.canonical
        phi = np.array([np.concatenate(canonical.parameters(p)) for p in parameters])
        return phi, coefficients


class _StateRobot(SymbolicRobot):
    """The symbolic robot; free parameters are inputs of the tape."""

    def __init__(self, robot: Any, tape: Tape, free: bool, model: Any) -> None:
        super().__init__(robot, tape)
        self._free, self._own = free, getattr(model, "inertial_parameters_", None)

    def inverse_dynamics(
        self, q: Any, dq: Any, ddq: Any, *, parameters: Any = None, gravity: Any = None
    ) -> Symbols:
        """Torques, shape (1, n_joints)."""
        if not (self._free and parameters is self._own):
            return super().inverse_dynamics(q, dq, ddq, parameters=parameters, gravity=gravity)
        engine = self._robot._engine
        program = engine.program("inverse_dynamics", engine.gravity_key(gravity), True, True, False)
        phi = [self._tape.input("phi", i) for i in range(10 * self._robot.n_bodies)]
        return self._run(program, q=q, dq=dq, ddq=ddq, parameter=[phi])


def _model_torque(model: Any, moment: _Moment) -> Any:
    """Torque of the model, with the columns of hysteresis from its given states."""
    kept = list(model.effect_terms_)
    if not moment.states:
        return model._torque(moment)
    plain = copy.copy(model)
    plain.effect_terms_ = [t for t in kept if t not in moment.states]
    # Hysteresis is friction and acts before the torque sensor, so it is added to the columns of the
    # remaining terms, which keeps the model's own order.
    torque = plain._torque(moment)
    gain = {t.places[0]: plain.effect_coefficients_[t][0] for t in kept if t.kind == "torque_gain"}
    for term, states in moment.states.items():
        effect = term.effect
        (j,) = term.places
        assert isinstance(effect, PathMemory)
        block = effect.columns_at(moment, j, states, **term.shape)
        own = block @ model.effect_coefficients_[term]
        torque[:, j] = torque[:, j] + own * (1.0 + gain.get(j, 0.0))
    return torque


def _elastic(forward: ForwardModel, term: Term) -> None:
    (joint,) = term.places
    compliance = float(forward.model.effect_coefficients_[term][0])
    if compliance <= 0:
        raise SkidynError(
            f"{term} has the compliance {compliance:.3g}; only a "
            "positive one can be simulated. Fit with consistent=True, or without the effect"
        )
    stiffness = 1.0 / compliance
    ratio = term.shape.get("damping", DAMPING_OF_STIFFENING)
    damping = 2 * ratio * stiffness / (2 * np.pi * term.shape["resonance"])
    stiffening = float(term.shape.get("stiffening", np.inf))
    forward.springs.append(Spring(joint, stiffness, damping, stiffening=stiffening))


def _loose(forward: ForwardModel, term: Term) -> None:
    (joint,) = term.places
    gap = float(forward.model.effect_coefficients_[term][0]) * term.shape["gap"]
    if gap <= 0:
        raise SkidynError(
            f"{term} has the gap {gap:.3g}; only a positive one "
            "can be simulated. Fit with consistent=True, or without the effect"
        )
    # The flanks deform by a hundredth of the gap under the weight of the arm, and absorb the
    # impact, as in the effect's own formula.
    robot = forward.model.robot_
    inertia = abs(float(robot.mass_matrix(np.zeros((1, robot.n_joints)))[0, joint, joint]))
    rest = abs(float(robot.gravity_torque(np.zeros((1, robot.n_joints)))[0, joint]))
    stiffness = 100 * max(rest, 10.0 * inertia) / gap
    forward.springs.append(Spring(joint, stiffness, 2 * np.sqrt(stiffness * inertia), gap))


def _late(forward: ForwardModel, term: Term) -> None:
    delay = float(forward.model.effect_coefficients_[term][0])
    forward.delay[list(term.places)] += delay


#: Effects that act on the motion itself or on the clock, not on the torque of an instant.
_APART = {"joint_elasticity": _elastic, "backlash": _loose, "time_delay": _late}
