# SPDX-License-Identifier: BSD-3-Clause
"""Pieces of a log, simulated side by side."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._columns import column_names, command_columns, names_of_table, resolve_columns
from skidyn._exceptions import SkidynError
from skidyn._signals import Array, Signals, rates_of, refuse_other_order, signals_from
from skidyn._text import counted
from skidyn.evidence import smooth_motion
from skidyn.forward._controller import Controller
from skidyn.forward._model import Conditions, ForwardModel
from skidyn.forward._stepper import LOST, State, Stepper
from skidyn.forward._windows import Windows, make_windows
from skidyn.robots import Robot

Rows = NDArray[np.int64]

#: Longest step, s. The error of a step is some 0.04 h^2 times the third derivative: 2e-5 rad over
#: a second of fast motion.
STEP = 2e-3


@dataclass(frozen=True)
class Task:
    """A simulation to be run.

    Attributes
    ----------
    signals : Signals
        Motion from which the pieces start.
    windows : Windows
        The pieces.
    torque : ndarray of shape (n_samples, n_joints) or None
        Torque that drives the model without a controller.
    controller : Controller or None
        Controller that drives the model.
    reference, rate : ndarray of shape (n_samples, n_joints) or None
        Reference of the controller and its velocity.
    """

    signals: Signals
    windows: Windows
    torque: Array | None = None
    controller: Controller | None = None
    reference: Array | None = None
    rate: Array | None = None


def robot_of(model: Any) -> Robot:
    """Robot of a fitted physical model; a SkidynError for other models."""
    if not hasattr(model, "robot_"):
        raise SkidynError(
            f"{type(model).__name__} has no fitted robot: give a fitted RBDRegressor; the physical "
            "part of a hybrid model is its physics_"
        )
    robot: Robot = model.robot_
    return robot


def read_task(
    model: Any, X: Any, y: Any, controller: Controller | None, horizon: float | None
) -> Task:
    """Signals, pieces and drive of a log."""
    n = robot_of(model).n_joints
    if (y is None) == (controller is None):
        raise SkidynError("give either the torque y or a controller, which follows q_ref1..")
    signals = motion_of(model, X)
    windows = make_windows(signals, horizon)
    if controller is None:
        refuse_other_order(y, model.robot_)
        torque = np.asarray(y, dtype=float)
        if len(torque) != len(signals.q):
            raise SkidynError(
                f"y has {len(torque)} rows and X {len(signals.q)}; give the torque of every row"
            )
        torque = torque.reshape(len(signals.q), -1)
        if torque.shape[1] != n:
            raise SkidynError(
                f"y has {torque.shape[1]} column(s); the robot has {counted(n, 'joint')}"
            )
        _refuse_gaps(torque, "torques")
        return Task(signals, windows, torque)
    return commanded(signals, windows, controller, references(X, model.robot_))


def commanded(signals: Signals, windows: Windows, controller: Controller, reference: Array) -> Task:
    """Pieces of a log in which a controller follows its reference."""
    assert signals.time is not None
    rate = rates_of(reference, signals.time, signals.segments)
    checked = controller.checked(reference.shape[1])
    return Task(signals, windows, None, checked, reference, rate)


def motion_of(model: Any, X: Any) -> Signals:
    """Signals of a log; smoothed where the model smooths or the log has no accelerations."""
    names = names_of_table(X)
    robot = model.robot_
    columns = resolve_columns(
        names,
        len(names),
        robot.joint_names,
        trajectory=model.trajectory,
        time=model.time,
        require_acceleration=False,
    )
    if columns.time is None:
        raise SkidynError("the log has no column 'time' (s); a simulation needs it")
    used = [*columns.state(), columns.time, *(columns.temperature or ())]
    used += [] if columns.trajectory is None else [columns.trajectory]
    table = np.full((len(X), len(names)), np.nan)
    for k in used:
        table[:, k] = np.asarray(X[names[k]], dtype=float)
    given = columns.ddq is not None
    signals = signals_from(table, replace(columns, ddq=columns.ddq or columns.dq), robot)
    for values, what in ((signals.q, "positions"), (signals.dq, "velocities")):
        _refuse_gaps(values, what)
    if model._smooths() or not given:
        signals = smooth_motion(signals)
    return signals.with_(robot=robot)


def _refuse_gaps(values: Array, what: str) -> None:
    broken = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if len(broken):
        raise SkidynError(
            f"{what} of the log are not numbers in row {broken[0]} ({len(broken)} row(s)); leave "
            "these rows out of X and y"
        )


def references(X: Any, robot: Robot) -> Array:
    """Commanded positions of a log, shape (n_samples, n_joints)."""
    wanted = command_columns(column_names(X) or [], robot.joint_names)
    reference = np.column_stack([np.asarray(X[name], dtype=float) for name in wanted])
    _refuse_gaps(reference, "references")
    return reference


def run(
    forward: ForwardModel,
    task: Task,
    step: float = STEP,
    theta: tuple[Array, Array] | None = None,
) -> tuple[Array, Array]:
    """Positions and velocities of the motors, shape (n_rows, n_samples, n_joints).

    With ``theta`` every piece is simulated once for each model; models are the first axis.
    """
    n, windows = forward.n, task.windows
    models = 1 if theta is None else len(theta[0])
    rows: Rows = np.tile(windows.rows, (models, 1))
    time = np.tile(windows.time, (models, 1))
    if theta is not None:
        pieces = len(windows.rows)
        theta = (np.repeat(theta[0], pieces, axis=0), np.repeat(theta[1], pieces, axis=0))
    signals = task.signals
    conditions = Conditions(
        signals.trajectory[rows[:, 0]],
        time[:, 0],
        None if signals.temperature is None else signals.temperature[rows[:, 0]],
    )
    drive, feed = _drive(forward, task, rows, time)
    stepper = Stepper(forward, drive, feed, conditions, theta)
    state = _start(forward, signals, rows[:, 0], stepper)
    _check_inertia(stepper, state)
    n_samples = rows.shape[1]
    q, dq = (np.full((len(rows), n_samples, n), np.nan) for _ in range(2))
    q[:, 0], dq[:, 0] = state.q[:, :n], state.dq[:, :n]
    lost = np.zeros(len(rows), dtype=bool)
    safe = State(state.q.copy(), state.dq.copy(), state.direction.copy(), state.memory.copy())
    for k in range(n_samples - 1):
        span = time[:, k + 1] - time[:, k]
        parts = max(1, int(np.ceil(span.max() / step - 1e-9)))
        if signals.temperature is not None:
            conditions.temperature = signals.temperature[rows[:, k]]
        for part in range(parts):
            state = stepper.step(state, time[:, k] + span * part / parts, span / parts)
        away = ~np.isfinite(state.q).all(axis=1) | (np.abs(state.dq) > LOST).any(axis=1)
        if away.any():
            lost |= away
            state.put(np.flatnonzero(away), safe)
        q[:, k + 1], dq[:, k + 1] = state.q[:, :n], state.dq[:, :n]
        q[lost, k + 1] = dq[lost, k + 1] = np.nan
    return q, dq


def _start(forward: ForwardModel, signals: Signals, first: Rows, stepper: Stepper) -> State:
    """The logged state, with links in static equilibrium on their springs."""
    q, dq = signals.q[first], signals.dq[first]
    memory = forward.starting_states(signals)[first]
    direction = np.sign(dq)
    # At rest the direction is that in which friction holds; the first step finds it.
    direction[np.abs(dq) < 1e-6 * forward.unit] = 0.0
    for spring in forward.springs:
        ddq = signals.ddq[first]
        given = q[None, :, : forward.n], dq[None, :, : forward.n], ddq[None], direction[None]
        _, rigid = forward.torque(*given, memory[None], stepper.conditions, stepper.theta)[:, 0]
        load = rigid[:, spring.joint]
        q = np.column_stack([q, q[:, spring.joint] - spring.twist(load)])
        dq = np.column_stack([dq, dq[:, spring.joint]])
    return State(q.copy(), dq.copy(), direction, memory)


def _drive(forward: ForwardModel, task: Task, rows: Rows, time: Array) -> Any:
    """Torque of the drive at times near those of the log."""
    n_rows, n_samples = rows.shape
    place = np.arange(n_rows)
    at = np.zeros(n_rows, dtype=int)

    def between(values: Array, moment: Array) -> Array:
        """Linear interpolation of (n_samples, n) values of the log at a time of every piece."""
        nonlocal at
        while True:
            later = (at < n_samples - 2) & (moment > time[place, at + 1] + 1e-12)
            if not later.any():
                break
            at = at + later
        while True:
            sooner = (at > 0) & (moment < time[place, at])
            if not sooner.any():
                break
            at = at - sooner
        a, b = rows[place, at], rows[place, at + 1]
        share = (moment - time[place, at]) / (time[place, at + 1] - time[place, at])
        share = np.clip(share, 0.0, 1.0)[:, None]
        return np.asarray(values[a] + share * (values[b] - values[a]))

    def logged(moment: Array) -> Array:
        assert task.torque is not None
        if not forward.delay.any():
            return between(task.torque, moment)
        # The logged torque is delayed: the torque that acts now is logged later.
        late = [moment + delay for delay in forward.delay]
        return np.column_stack(
            [between(task.torque[:, [j]], at)[:, 0] for j, at in enumerate(late)]
        )

    def controlled(moment: Array, q: Array, dq: Array) -> Array:
        assert task.controller is not None and task.reference is not None
        assert task.rate is not None
        late = moment - task.controller.delay
        return task.controller.torque(
            q, dq, between(task.reference, late), between(task.rate, late)
        )

    return (None, logged) if task.controller is None else (controlled, None)


def _check_inertia(stepper: Stepper, state: State) -> None:
    """Refuse a model whose inertia is not positive definite: its motion would diverge at once."""
    n, rows = stepper.n, len(state.q)
    shape = (n + 1, rows, n)
    ddq = np.zeros(shape)
    ddq[1:] = np.eye(n)[:, None]
    values = stepper.forward.torque(
        np.broadcast_to(state.q[:, :n], shape),
        np.zeros(shape),
        ddq,
        np.zeros(shape),
        np.broadcast_to(state.memory, (n + 1, *state.memory.shape)),
        stepper.conditions,
        stepper.theta,
    )[0].copy()
    inertia = np.moveaxis(values[1:] - values[0], 0, -1)
    least = np.linalg.eigvalsh((inertia + inertia.swapaxes(1, 2)) / 2)[:, 0]
    if not np.all(least > 0.0):
        row = int(np.argmin(least))
        raise SkidynError(
            f"the inertia matrix of the model has the eigenvalue {least[row]:.3g} at the start of "
            f"piece {row}: such bodies cannot be simulated. Fit with consistent=True, or give the "
            "links an <inertial>."
        )
