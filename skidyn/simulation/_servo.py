# SPDX-License-Identifier: BSD-3-Clause
"""Robots that log commands and positions but no torque: position servos as torque sensors."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._columns import command_columns, names_of_table, resolve_columns, trajectory_numbers
from skidyn._exceptions import LogWarning, SkidynError
from skidyn._signals import Array, Signals, rates_of, signals_from
from skidyn._text import counted, listed
from skidyn.evidence import smooth_motion
from skidyn.forward import Controller
from skidyn.robots import Robot

#: Longest delay of the command that is tried, s.
LONGEST_DELAY = 0.1
#: Least ratio of the inverse of a gain to its standard error.
SEEN = 3.0
#: Velocity (rad/s) below which dry friction may have any value up to its maximum, so that the
#: position error has no information.
RESTS = 0.03
#: Share by which the gain of one recording may differ, and least rows in motion for the check.
OTHER, LEAST_ROWS = 0.25, 200
#: Blocks of time left out in turn for the standard error of a gain.
BLOCKS = 10


def servo_torque(controller: Controller, log: Any) -> Array:
    """Torque of position servos from their commands and positions.

    The torque of a servo with known gain is its gain times its position error. With this torque,
    functions for logs with torque, such as :class:`~skidyn.identification.RBDRegressor` or
    :func:`~skidyn.diagnosis.diagnose`, can be used for logs without torque. An error of 10 % of the
    gain causes errors of 10 % of all sizes, but does not change the identified effects.

    Parameters
    ----------
    controller : Controller
        Gains of the servos, delay of the command, limit of the torque.
    log : DataFrame
        ``time`` (s), ``q1..``, ``dq1..`` (rad, m) and the command ``q_ref1..`` or
        ``cmd1..``; with several recordings also ``trajectory``.

    Returns
    -------
    ndarray of shape (n_samples, n_joints)
        N m or N.

    Raises
    ------
    SkidynError
        A column is missing.

    Examples
    --------
    >>> import pandas as pd
    >>> from skidyn.simulation import Controller, servo_torque
    >>> log = pd.DataFrame({"time": [0.0, 0.01], "q1": [0.0, 0.0], "dq1": 0.0, "q_ref1": [0.1, 0.2]})
    >>> servo_torque(Controller(20.0), log).round(3).ravel().tolist()
    [2.0, 4.0]
    """  # noqa: E501
    signals, reference = _read(log, None)
    own = controller.checked(reference.shape[1])
    wanted, rate = _late(signals, reference, own.delay)
    return own.torque(signals.q, signals.dq, wanted, rate)


def fit_servo(robot: Robot, log: Any, *, shared: bool = False) -> Controller:
    """Gain and delay of position servos from the weight of the robot.

    A servo that holds a load against gravity has a position error that depends on its gain: the
    error is fitted by the rigid-body torque of the URDF, viscous and dry friction and a constant,
    joint by joint [1]_. The delay of the command is the best-fitting one from 0 to 0.1 s. Damping
    of the servo and viscous friction cannot be separated by motion alone; both are included in the
    model. In slow motion a delayed command also resembles damping: only motion at some hertz
    separates them.

    Parameters
    ----------
    robot : Robot
        Robot, whose inertial parameters are assumed to be correct: the gains scale with them.
    log : DataFrame
        ``time`` (s), ``q1..``, ``dq1..`` and the command ``q_ref1..`` or ``cmd1..``, and
        ``trajectory`` if there are several.
    shared : bool, default=False
        One gain for all joints, which have the same servo and settings. Needed for joints without
        gravity torque.

    Returns
    -------
    Controller
        With ``stiffness`` (N m/rad) and ``delay`` (s); damping is 0, since it is included in the
        viscous friction of the model.

    Raises
    ------
    SkidynError
        A column is missing, or the log does not show the gain of a joint.

    Warns
    -----
    LogWarning
        The gain of one recording differs from that of all.

    References
    ----------
    .. [1] M. Duclusaud, G. Passault, V. Padois, O. Ly (2024), Extended friction models for the
       physics simulation of servo actuators.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.simulation import fit_servo
    >>> log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2)
    >>> frame = log.frame
    >>> for j in (1, 2):  # a servo of 40 N m/rad: its error is the torque over its gain
    ...     frame[f"q_ref{j}"] = frame[f"q{j}"] + frame[f"tau{j}"] / 40.0
    >>> servo = fit_servo(log.robot, frame)
    >>> bool(abs(servo.stiffness[0] / 40 - 1) < 0.05), round(servo.delay, 3)
    (True, 0.0)
    """
    signals, reference = _read(log, robot)
    n = robot.n_joints
    if reference.shape[1] != n:
        raise SkidynError(
            f"the log has {reference.shape[1]} commands; the robot has {counted(n, 'joint')}"
        )
    torque = robot.inverse_dynamics(signals.q, signals.dq, signals.ddq)
    designs = [
        np.column_stack([torque[:, j], signals.dq[:, j], signals.sign[:, j], 1 + 0 * torque[:, j]])
        for j in range(n)
    ]
    moves = np.abs(signals.dq) > RESTS * signals.unit
    step = float(np.median(np.diff(signals.clock)))
    # The same for every delay: a late command makes the error itself larger.
    size = np.std(reference - signals.q, axis=0) + 1e-12
    best: tuple[float, float, Array] = (np.inf, 0.0, np.zeros((1, n)))
    for delay in step * np.arange(int(LONGEST_DELAY / step) + 1):
        wanted, _ = _late(signals, reference, float(delay))
        error = wanted - signals.q
        inverse, left = _inverse_gains(designs, error, moves, size, shared)
        if left < best[0] * (1 - 1e-6):
            best = left, float(delay), inverse
    _, delay, inverse = best
    value, std = inverse[0], _std(inverse)
    hidden = np.flatnonzero(~(value > SEEN * std))
    if len(hidden):
        names = ", ".join(robot.joint_names[j] for j in hidden)
        remedy = (
            "Give a Controller with the known gain"
            if shared
            else "Give --controller fit-shared (in Python: shared=True) if all joints have the "
            "same servo, or a Controller with the known gain"
        )
        raise SkidynError(
            f"this log does not determine the servo gain of {names}: the position error there is "
            f"not related to the weight of the robot. {remedy}"
        )
    wanted, _ = _late(signals, reference, delay)
    _warn_of_other_gains(
        robot, signals.trajectory, designs, wanted - signals.q, moves, size, shared, inverse
    )
    return Controller(stiffness=1.0 / value, damping=0.0, delay=delay, follows_velocity=False)


def _std(inverse: Array) -> Array:
    """Standard errors, from all rows and without one block each."""
    spread = (inverse[1:] - inverse[1:].mean(axis=0)) ** 2
    return np.asarray(np.sqrt((BLOCKS - 1) / BLOCKS * np.sum(spread, axis=0)))


def _warn_of_other_gains(
    robot: Robot,
    trajectory: NDArray[np.int64],
    designs: list[Array],
    error: Array,
    moves: NDArray[np.bool_],
    size: Array,
    shared: bool,
    whole: Array,
) -> None:
    """Warn if the weight gives a different gain in one recording than in the others."""
    names = np.unique(trajectory)
    if len(names) < 2:
        return
    told = []
    for name in names:
        rows = trajectory == name
        seen = np.flatnonzero(moves[rows].sum(axis=0) >= LEAST_ROWS)
        if not len(seen):
            continue
        own = [designs[j][rows] for j in seen]
        here = np.ix_(rows, seen)
        inverse, _ = _inverse_gains(own, error[here], moves[here], size[seen], shared)
        value, std, all_of = inverse[0], _std(inverse), whole[:, seen]
        sure = np.hypot(std, _std(all_of))
        apart = np.abs(value - all_of[0]) > np.maximum(SEEN * sure, OTHER * all_of[0])
        for k in np.flatnonzero(apart & (value > SEEN * std))[: 1 if shared else None]:
            what = "" if shared else f" of {robot.joint_names[seen[k]]}"
            told.append(f"{1 / value[k]:.3g} N m/rad{what} in recording {name:g}")
    if told:
        all_ = ", ".join(f"{1 / v:.3g}" for v in (whole[0, :1] if shared else whole[0]))
        warnings.warn(
            "the servo gain estimated from the weight of the robot differs between recordings: "
            f"{listed(told)}, {all_} in all of them. The gain was changed, or the torque or speed "
            "of the servo is at a limit in some; use recordings with the same settings that stay "
            "within the limits of the servo",
            LogWarning,
            stacklevel=3,
        )


def _inverse_gains(
    designs: list[Array], error: Array, moves: NDArray[np.bool_], size: Array, shared: bool
) -> tuple[Array, float]:
    """Inverse gains of all rows and without one block each, and the remaining error."""
    rows = len(error)
    block = np.arange(rows) * BLOCKS // rows
    found, left = [], 0.0
    for k in range(-1, BLOCKS):
        used = [(block != k) & moves[:, j] for j in range(len(designs))]
        if not shared:
            parts = [
                np.linalg.lstsq(a[keep], error[keep, j], rcond=None)[0]
                for j, (a, keep) in enumerate(zip(designs, used, strict=True))
            ]
            inverse = np.array([x[0] for x in parts])
        else:
            # Friction of every joint is eliminated from its torque and error, which leaves one
            # slope.
            pairs = []
            for j, (a, keep) in enumerate(zip(designs, used, strict=True)):
                q, _ = np.linalg.qr(a[keep, 1:])
                both = np.column_stack([a[keep, 0], error[keep, j]])
                pairs.append(both - q @ (q.T @ both))
            slope = sum(p[:, 0] @ p[:, 1] for p in pairs) / sum(p[:, 0] @ p[:, 0] for p in pairs)
            inverse = np.full(len(designs), slope)
            parts = []
            for j, (a, keep) in enumerate(zip(designs, used, strict=True)):
                rest = error[keep, j] - slope * a[keep, 0]
                parts.append(np.r_[slope, np.linalg.lstsq(a[keep, 1:], rest, rcond=None)[0]])
        found.append(inverse)
        if k < 0:
            residual = error - np.column_stack([a @ x for a, x in zip(designs, parts, strict=True)])
            left = float(np.mean((residual / size)[moves] ** 2))
    return np.array(found), left


def _read(log: Any, robot: Robot | None) -> tuple[Signals, Array]:
    """Signals, smoothed where a robot needs accelerations, and the command."""
    names = names_of_table(log, "time, q1.., dq1.., q_ref1..")
    joints: list[str] = [] if robot is None else list(robot.joint_names)
    if robot is None:
        while f"q{len(joints) + 1}" in names:
            joints.append(f"joint{len(joints) + 1}")
    columns = resolve_columns(names, len(names), joints, require_acceleration=False)
    if columns.time is None:
        raise SkidynError("the log has no column 'time' (s)")
    wanted = command_columns(names, joints)
    used = [*columns.q, *columns.dq, columns.time]
    used += [] if columns.trajectory is None else [columns.trajectory]
    table = np.zeros((len(log), len(names)))
    for k in used:
        table[:, k] = np.asarray(log[names[k]], dtype=float)
    plain = replace(columns, ddq=columns.dq, temperature=None)
    signals = signals_from(table, plain, robot)
    signals = signals.with_(trajectory=trajectory_numbers(table, plain))
    if robot is not None:
        signals = smooth_motion(signals)
    return signals, np.column_stack([np.asarray(log[name], dtype=float) for name in wanted])


def _late(signals: Signals, reference: Array, delay: float) -> tuple[Array, Array]:
    """The command as received by the servo, and its velocity."""
    wanted = reference.copy()
    for rows in signals.segments:
        time = signals.clock[rows]
        for j in range(reference.shape[1]):
            wanted[rows, j] = np.interp(time - delay, time, reference[rows, j])
    return wanted, rates_of(wanted, signals.clock, signals.segments)
