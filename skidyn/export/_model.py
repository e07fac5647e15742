# SPDX-License-Identifier: BSD-3-Clause
"""A fitted model as one list of operations on q, dq and ddq."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn._signals import Signals
from skidyn.dynamics import BoundProgram, Program, Scalar, Tape, evaluate_rows
from skidyn.effects import Term
from skidyn.identification import RBDRegressor
from skidyn.robots import Instant, Robot, SymbolicRobot, symbols

#: Number of samples at which the program is compared with the model, and permitted relative
#: difference.
_SAMPLES, _ROUNDING = 64, 1e-9


@dataclass(frozen=True)
class StaticModel:
    """Parts of a model that are a function of q, dq and ddq, and the other parts.

    ``left`` are effects with a memory, or that depend on time, temperature or the recording.
    """

    robot: Robot
    program: Program
    held: list[Term]
    left: list[Term]

    @property
    def title(self) -> str:
        """Description of the included effects."""
        kinds = dict.fromkeys(term.kind for term in self.held)
        return ", ".join(["rigid bodies", *(kind.replace("_", " ") for kind in kinds)])

    @property
    def left_names(self) -> list[str]:
        """Names of the effects that are left out."""
        return [name_term(self.robot, term) for term in self.left]


def static_model(model: RBDRegressor | Robot) -> StaticModel:
    """Record the part of a model that is a function of q, dq and ddq.

    The model's own code is run on symbols, so effects, including those registered by users, need no
    second definition. Each effect is then compared with its own columns on random numbers.
    """
    if isinstance(model, Robot):
        program = model._engine.fixed_inverse_dynamics(model.inertial_parameters)
        return StaticModel(model, program, [], [])
    check_model(model)
    held = [term for term in model.effect_terms_ if is_static(model, term)]
    if not _agrees(model, held, traced(model, held)):
        # Another effect depends on the torque of the bodies without the payload.
        held = [term for term in held if not is_carried(term)]
    left = [term for term in model.effect_terms_ if term not in held]
    return StaticModel(model.robot_, traced(model, held), held, left)


def check_model(model: Any) -> None:
    """Raise an error for anything other than a robot or a fitted model."""
    if isinstance(model, Robot):
        return
    if not isinstance(model, RBDRegressor):
        raise SkidynError(
            f"model is {type(model).__name__}; expected a fitted RBDRegressor, or a Robot for the "
            "rigid bodies of its description."
        )
    if not hasattr(model, "effect_terms_"):
        raise SkidynError("the model is not fitted; call its fit before exporting it.")


def _with_terms(model: RBDRegressor, terms: Sequence[Term]) -> RBDRegressor:
    """The model with some of its effects, and with payloads as parts of their bodies."""
    part = copy.copy(model)
    carried = [t for t in terms if is_carried(t)]
    part.effect_terms_ = [t for t in terms if t not in carried]
    parameters = model.inertial_parameters_.copy()
    for term in carried:
        parameters[term.shape.get("link", -1)] += model.effect_coefficients_[term]
    part.inertial_parameters_ = parameters
    return part


def is_carried(term: Term) -> bool:
    """Whether a term is a permanent payload."""
    return term.kind == "payload" and term.shape.get("trajectories") is None


def is_lasting(term: Term) -> bool:
    """Whether a term acts in all recordings, and not in some of them only."""
    return all(term.shape.get(key) is None for key in ("trajectory", "trajectories"))


def traced(model: RBDRegressor, terms: Sequence[Term]) -> Program:
    tape, n = Tape(), model.robot_.n_joints
    robot: Any = SymbolicRobot(model.robot_, tape)
    part = _with_terms(model, terms)
    part.robot_ = robot
    q, dq, ddq = (symbols(tape, name, n) for name in ("q", "dq", "ddq"))
    instant = Instant(
        q, dq, ddq, np.zeros(1, dtype=int), prismatic=_sliding(model.robot_), robot=robot
    )
    torque = part._torque(instant)[0]
    outputs: dict[tuple[int, ...], Scalar] = {
        (j,): tape.constant(0.0) + torque[j] for j in range(n)
    }
    return Program(tape, outputs, (n,))


def is_static(model: RBDRegressor, term: Term) -> bool:
    """Whether an effect can be recorded with the same torque."""
    if not is_lasting(term):
        return False
    try:
        program = traced(model, [term])
    except Exception:  # any error of an effect given symbols: it cannot be recorded
        return False
    return _agrees(model, [term], program)


def _agrees(model: RBDRegressor, terms: Sequence[Term], program: Program) -> bool:
    """Whether a program gives the torque of the model with these effects, on random numbers."""
    signals = random_signals(model.robot_)
    part = copy.copy(model)
    part.effect_terms_ = list(terms)
    expected = part._torque(signals)
    given = {"q": signals.q, "dq": signals.dq, "ddq": signals.ddq}
    bound = BoundProgram(program, _SAMPLES, np.dtype(float))
    written = evaluate_rows(bound, given, _SAMPLES)
    return bool(np.abs(written - expected).max() <= _ROUNDING * (1 + np.abs(expected).max()))


def random_signals(robot: Robot) -> Signals:
    rng = np.random.default_rng(0)
    q, dq, ddq = rng.normal(size=(3, _SAMPLES, robot.n_joints))
    dq[::8] *= 1e-3  # where the sign of the velocity is smooth
    return Signals(
        q,
        dq,
        ddq,
        np.zeros(_SAMPLES, dtype=int),
        time=np.linspace(0.0, 1.0, _SAMPLES),
        temperature=rng.uniform(20.0, 50.0, q.shape),
        prismatic=_sliding(robot),
        robot=robot,
    )


def _sliding(robot: Robot) -> np.ndarray:
    return np.array([kind == "prismatic" for kind in robot.joint_types])


def describe_term(model: RBDRegressor, term: Term) -> dict[str, Any]:
    """An effect as plain data, complete: coefficients by name, with units."""
    robot = model.robot_
    prismatic = bool(_sliding(robot)[list(term.places)].all())
    turns = {c.name: c.unit for c in term.coefficients}
    units = {
        name: unit.replace("N m", "N").replace("rad", "m") if prismatic else unit
        for name, unit in turns.items()
    }
    values = model.effect_coefficients_[term]
    return {
        "kind": term.kind,
        "joints": [robot.joint_names[j] for j in term.places],
        "coefficients": dict(zip(turns, map(float, values), strict=True)),
        "units": units,
        "shape": dict(term.shape),
    }


def name_term(robot: Robot, term: Term) -> str:
    """An effect in words, such as ``"dahl of joint2"``."""
    joints = [robot.joint_names[j] for j in term.places]
    where = "all joints" if len(joints) == robot.n_joints > 1 else ", ".join(joints)
    return f"{term.kind} of {where}"
