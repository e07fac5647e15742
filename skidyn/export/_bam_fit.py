# SPDX-License-Identifier: BSD-3-Clause
"""BAM's models of friction, fitted to a log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from skidyn._columns import names_of_table, resolve_columns
from skidyn._exceptions import SkidynError
from skidyn._signals import signals_from
from skidyn._text import counted
from skidyn.evidence import smooth_motion
from skidyn.export._bam import (
    BamModel,
    checked_actuator,
    friction_budget,
    friction_parameters,
    joint_place,
    motor_constants,
)
from skidyn.robots import Robot

#: Velocity (rad/s) below which friction may have any value up to its maximum.
_RESTS = 0.03
#: Number of rows to which moving samples are thinned; far more than parameters.
_ROWS = 20_000
#: Initial values of the Stribeck velocity, and its limits, rad/s.
_SPEEDS, _SLOWEST, _FASTEST = (0.1, 0.5, 2.0), 0.01, 20.0
#: Limits of the exponent.
_EXPONENT = (0.4, 10.0)


def fit_bam(
    robot: Robot,
    X: Any,
    y: Any,
    *,
    joint: str | int | None = None,
    name: str = "m6",
    actuator: str,
    motor: Mapping[str, float] | None = None,
) -> BamModel:
    """Fit one of BAM's models of friction, and the armature, to torque of a motor.

    The bodies of the robot are assumed to be known, as for BAM's pendulum; the remaining torque of
    the motor is due to armature and friction. Least squares over the moving samples, from several
    starts; friction is not negative.

    Parameters
    ----------
    robot : Robot
        Robot with correct inertial parameters; identified ones are set by
        ``dataclasses.replace(robot, inertial_parameters=model.inertial_parameters_)``.
    X : DataFrame
        Motion, with ``time`` (s), ``q1..``, ``dq1..`` (rad, rad/s); it is smoothed.
    y : array-like of shape (n_samples, n_joints), N m
        Torque of the motors.
    joint : str or int, optional
        Joint, by name or counted from 1; not needed if there is one.
    name : {"m1", "m2", "m3", "m4", "m5", "m6"}, default="m6"
        Model of friction.
    actuator : str
        Name of the servo in BAM, such as ``"xl330"``.
    motor : mapping of str to float, optional
        Constants of the motor, which the torque does not determine: ``kt``, ``R`` and others.

    Returns
    -------
    BamModel
        Model that :func:`write_bam` can write.

    Raises
    ------
    SkidynError
        The joint is unknown or prismatic, a column is missing, or too few samples move.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.export import fit_bam
    >>> log = make_hidden_effect_log(load_planar_arm(), None)
    >>> servo = fit_bam(log.robot, log.X, log.y, joint="joint2", name="m1", actuator="mx64")
    >>> bool(servo.parameters["friction_base"] > 0)
    True
    """
    keys = ["armature", *friction_parameters(name)]
    constants, servo = motor_constants(motor), checked_actuator(actuator)
    j = joint_place(robot, joint)
    q, dq, ddq = _motion(robot, X)
    torque = np.asarray(y, dtype=float).reshape(len(q), -1)
    if torque.shape[1] != robot.n_joints:
        raise SkidynError(
            f"y has {torque.shape[1]} column(s); the robot has {counted(robot.n_joints, 'joint')}"
        )
    whole = np.isfinite(torque[:, j]) & np.isfinite(np.hstack([q, dq, ddq])).all(axis=1)
    rows = np.flatnonzero(whole & (np.abs(dq[:, j]) > _RESTS))
    if len(rows) < 10 * len(keys):
        raise SkidynError(
            f"{len(rows)} samples of {robot.joint_names[j]} move faster than {_RESTS} rad/s; its "
            f"model {name} has {len(keys)} parameters"
        )
    rows = rows[:: len(rows) // _ROWS + 1]
    bodies = robot.inverse_dynamics(q[rows], dq[rows], ddq[rows])[:, j]
    outside = -robot.inverse_dynamics(q[rows], dq[rows], 0.0 * ddq[rows])[:, j]
    given, speed, own = torque[rows, j], dq[rows, j], ddq[rows, j]
    size = float(np.std(given)) + 1e-12

    def residual(x: Any) -> Any:
        values = dict(zip(keys, x, strict=True))
        friction = np.sign(speed) * friction_budget(name, values, given, outside, speed)
        return (bodies + values["armature"] * own + friction - given) / size

    low = np.array([{"dtheta_stribeck": _SLOWEST, "alpha": _EXPONENT[0]}.get(k, 0.0) for k in keys])
    high = np.array(
        [{"dtheta_stribeck": _FASTEST, "alpha": _EXPONENT[1]}.get(k, np.inf) for k in keys]
    )
    fits = []
    for start in _SPEEDS if "alpha" in keys else _SPEEDS[:1]:
        typical = {"dtheta_stribeck": start, "alpha": 1.5, "armature": 1e-3}
        first = np.array([typical.get(k, 0.05 if "load" in k else 0.05 * size) for k in keys])
        fits.append(
            least_squares(residual, first, bounds=(low, high), x_scale=np.maximum(first, 1e-4))
        )
    best = min(fits, key=lambda fit: float(fit.cost))
    found = dict(zip(keys, map(float, best.x), strict=True))
    return BamModel(name, servo, {**found, **constants})


def _motion(robot: Robot, X: Any) -> tuple[Any, Any, Any]:
    """Smoothed motion of a table."""
    names = names_of_table(X)
    columns = resolve_columns(names, len(names), robot.joint_names, require_acceleration=False)
    if columns.time is None:
        raise SkidynError("the log has no column 'time' (s)")
    table = np.asarray(X, dtype=float)
    plain = replace(columns, ddq=columns.ddq or columns.dq, temperature=None)
    signals = smooth_motion(signals_from(table, plain, robot))
    return signals.q, signals.dq, signals.ddq
