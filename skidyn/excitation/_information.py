# SPDX-License-Identifier: BSD-3-Clause
"""The information of a motion: the information matrix of base parameters and effects."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._columns import resolve_columns
from skidyn._exceptions import SkidynError
from skidyn._signals import Array, signals_from
from skidyn.dynamics import BoundProgram, Program, Scalar, Tape, chunk_size, evaluate_rows
from skidyn.effects import Term, TermSum, make_terms
from skidyn.evidence import smooth_motion
from skidyn.excitation._excitation import Excitation
from skidyn.export import check_model, static_model
from skidyn.identification import RBDRegressor
from skidyn.robots import Instant, Robot, SymbolicRobot, base_parameter_index, replay, symbols

if TYPE_CHECKING:
    import torch

#: Number of samples evaluated at a time, and rate in Hz at which designed motions count as
#: recorded.
_CHUNK, _RATE = 2048, 100.0


@dataclass(frozen=True)
class Model:
    """The model of a robot for which a motion is designed.

    Programs are the regressor of base parameters and effects, (n_joints, n_columns), and the
    torque, which has to stay within the limits; ``noise`` is the unit of each joint's torque, N m
    or N.
    """

    robot: Robot
    columns: Program
    torque: Program
    noise: Array

    def information(self, q: Array, dq: Array, ddq: Array, seconds: float) -> Array:
        """Information of a motion of given length, per second of recording.

        Noise of torques is correlated between samples, so the length of time counts and not the
        number of samples.
        """
        total = np.zeros(2 * (self.columns.shape[1],))
        for start in range(0, len(q), _CHUNK):
            rows = slice(start, start + _CHUNK)
            columns = evaluate(self.columns, q[rows], dq[rows], ddq[rows])
            flat = (columns / self.noise[:, None]).reshape(-1, total.shape[0])
            total += flat.T @ flat
        return total * seconds / len(q)

    def information_torch(
        self, q: torch.Tensor, dq: torch.Tensor, ddq: torch.Tensor, seconds: float
    ) -> torch.Tensor:
        """The same, differentiable."""
        import torch

        from skidyn.dynamics import evaluate_torch

        columns = evaluate_torch(self.columns, {"q": q, "dq": dq, "ddq": ddq})
        flat = (columns / torch.from_numpy(self.noise)[:, None]).reshape(-1, columns.shape[2])
        return flat.T @ flat * (seconds / len(q))


def evaluate(program: Program, q: Array, dq: Array, ddq: Array) -> Array:
    """Outputs of a program, shape (n_samples, *program.shape)."""
    bound = BoundProgram(program, chunk_size(len(q), 4096), np.dtype(float))
    return evaluate_rows(bound, {"q": q, "dq": dq, "ddq": ddq}, len(q))


def make_model(model: Robot | RBDRegressor, effects: Iterable[Any] | None) -> Model:
    """Regressor, torque and noise of a robot or of a fitted model."""
    check_model(model)
    if isinstance(model, Robot):
        robot = model
        noise = np.where(np.isfinite(robot.effort_limits), robot.effort_limits, 1.0)
        noise = np.where(noise > 0, noise, 1.0)
        terms = make_terms(("viscous", "coulomb") if effects is None else effects, robot.n_joints)
    else:
        robot, noise = model.robot_, np.asarray(model.noise_std_, dtype=float)
        known = static_model(model).held
        terms = known if effects is None else make_terms(effects, robot.n_joints)
    return Model(robot, _columns(robot, terms), static_model(model).program, noise)


def _columns(robot: Robot, terms: Sequence[Term]) -> Program:
    """Columns of the base parameters, then those of the effects."""
    tape, n = Tape(), robot.n_joints
    symbolic: Any = SymbolicRobot(robot, tape)
    q, dq, ddq = (symbols(tape, name, n) for name in ("q", "dq", "ddq"))
    place = {int(column): k for k, column in enumerate(base_parameter_index(robot))}
    whole = robot._engine.program("torque_regressor", robot._engine.gravity_key())
    kept = {key: scalar for key, scalar in whole.outputs.items() if key[1] in place}
    replayed = replay(
        Program(whole.tape, kept, whole.shape), tape, {"q": q[0], "dq": dq[0], "ddq": ddq[0]}
    )
    outputs: dict[tuple[int, ...], Scalar] = {}
    for (j, column), scalar in replayed.items():
        outputs[j, place[column]] = scalar
    sliding = np.array([kind == "prismatic" for kind in robot.joint_types])
    load = symbolic.inverse_dynamics(q, dq, ddq)
    instant = Instant(
        q, dq, ddq, np.zeros(1, dtype=int), prismatic=sliding, robot=symbolic, load=load
    )
    for term, own in TermSum(terms).slices(len(place)):
        for j, block in _effect_columns(term, instant).items():
            for k, value in enumerate(np.asarray(block)[0]):
                outputs[j, own.start + k] = tape.constant(0.0) + value
    return Program(tape, outputs, (n, len(place) + TermSum(terms).width))


def _effect_columns(term: Term, instant: Instant) -> dict[int, Array]:
    try:
        return term.torque_columns(instant)
    except KeyError as error:
        raise SkidynError(
            f"{term.kind} has the shape parameter {error}: give a Term with its value, such as "
            f"Term({term.kind!r}, {term.joints}, {{{error}: ...}})"
        ) from None
    except Exception as error:
        raise SkidynError(
            f"a motion cannot be designed for {term.kind}: it is not a function of q, dq and ddq "
            f"at one instant ({error})"
        ) from None


def recorded_information(model: Model, recorded: Any) -> Array:
    """Information of recordings already made."""
    total = np.zeros(2 * (model.columns.shape[1],))
    for item in recorded if isinstance(recorded, list | tuple) else [recorded]:
        if isinstance(item, Excitation):
            _, q, dq, ddq = item.sample(_RATE)
            total += model.information(q, dq, ddq, item.duration)
        else:
            total += _information_of_log(model, item)
    return total


def _information_of_log(model: Model, frame: Any) -> Array:
    if not hasattr(frame, "columns"):
        raise SkidynError(
            f"recorded holds {type(frame).__name__}; expected tables as read_log returns them, or "
            "an Excitation"
        )
    names = [str(name) for name in frame.columns]
    columns = resolve_columns(
        names, len(names), model.robot.joint_names, require_acceleration=False
    )
    if columns.time is None:
        raise SkidynError("a recording has no column 'time', which is needed for its duration")
    smooths = columns.ddq is None
    table = np.full((len(frame), len(names)), np.nan)
    table[:, columns.used()] = np.asarray(frame.iloc[:, columns.used()], dtype=float)
    signals = signals_from(table, columns, model.robot, to_derive=True)
    motion = smooth_motion(signals) if smooths else signals
    s = motion.take(np.asarray(motion.usable.all(axis=1)))
    if s.n_samples == 0:
        raise SkidynError("a recording is too short to derive accelerations from it")
    return model.information(s.q, s.dq, s.ddq, s.n_samples / signals.rate)
