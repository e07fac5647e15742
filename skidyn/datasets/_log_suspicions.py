# SPDX-License-Identifier: BSD-3-Clause
"""What looks wrong in a log, as sentences that hold the evidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.signal import butter, sosfiltfilt

from skidyn._signals import find_segments

if TYPE_CHECKING:
    from skidyn.datasets._log_quality import JointQuality
    from skidyn.robots import Robot

DEGREE = np.pi / 180
#: Units of time that a clock may be in, by the slope of integrated velocity on position.
CLOCKS = {1e3: "ms", 1e6: "us", 1e9: "ns"}


def clock_suspicions(clock: Mapping[str, Any], repeated: int, n_samples: int) -> list[str]:
    """Gaps, jitter, slow sampling, repeated rows."""
    messages = []
    if clock["rate"] < 2:
        # the unit in which a robot would have been sampled at a usual rate
        usual = [unit for factor, unit in CLOCKS.items() if 20 <= clock["rate"] * factor <= 2e4]
        unit = usual[0] if usual else "ms"
        messages.append(
            f"the median time step is {1 / clock['rate']:.4g} s: time may be in {unit} "
            f"(units={{'time': '{unit}'}})."
        )
    elif clock["rate"] < 20:
        messages.append(
            f"the log is sampled at {clock['rate']:.3g} Hz: accelerations, and with them inertias, "
            "cannot be told from it."
        )
    if clock["gaps"]:
        messages.append(
            f"{clock['gaps']} gap(s) in time inside trajectories, the longest "
            f"{clock['largest_gap']:.3g} s; filters and derivatives do not cross them."
        )
    if clock["jitter"] > 0.25:
        messages.append(
            f"the time step varies by {100 * clock['jitter']:.0f} % (5 to 95 % of the steps): "
            "derivatives use the recorded times."
        )
    if repeated > 0.02 * n_samples:
        messages.append(
            f"in {repeated} of {n_samples} rows no position changes although joints move: the "
            "recorder polled faster than the robot reports, so derivatives are too rough."
        )
    return messages


def unit_suspicions(
    joints: Sequence[JointQuality],
    q: np.ndarray,
    dq: np.ndarray,
    tau: np.ndarray,
    time: np.ndarray,
    trajectory: np.ndarray,
    robot: Robot | None,
) -> list[str]:
    """Degrees, milliseconds, velocities that are none, currents in the place of torques."""
    messages = _degrees(q, robot)
    odd_slopes = False
    for joint in joints:
        message = _slope_message(joint)
        if message and not (odd_slopes and "units=" in message):
            odd_slopes = odd_slopes or "units=" in message
            messages.append(message)
    if robot is not None and not messages:
        messages += _currents(q, dq, tau, time, trajectory, robot)
    return messages


def joint_suspicions(joints: Sequence[JointQuality], n_joints: int) -> list[str]:
    """Joints that do not move, saturated torque, torque that is late."""
    messages = []
    for k, joint in enumerate(joints):
        where = f"joint {k + 1} ({joint.name})" if joint.name != f"joint {k + 1}" else joint.name
        low, high = joint.position_range
        if not joint.excited:
            messages.append(
                f"{where} hardly moves ({low:.4g} .. {high:.4g}, {joint.reversals} reversals): its "
                "friction and inertia cannot be identified from this log."
            )
        if joint.torque_range[0] == joint.torque_range[1]:
            messages.append(f"the torque of {where} is constant ({joint.torque_range[0]:.4g}).")
        elif joint.saturated_share > 0.002:
            messages.append(
                f"the torque of {where} stays at its extreme value in "
                f"{100 * joint.saturated_share:.1f} % of the rows: the sensor or drive saturates."
            )
    late = np.array([joint.torque_delay for joint in joints if np.isfinite(joint.torque_delay)])
    # a real delay is the same in all joints; unmodelled friction shifts each by another amount
    if len(late) > n_joints / 2 and abs(np.median(late)) > max(0.004, 5 * late.std()):
        messages.append(
            f"torque is {'late' if np.median(late) > 0 else 'early'} against motion by about "
            f"{1e3 * abs(float(np.median(late))):.1f} ms (median over {len(late)} joints)."
        )
    return messages


def _degrees(q: np.ndarray, robot: Robot | None) -> list[str]:
    """Positions far outside the limits that would be inside if they were degrees."""
    largest = np.abs(q).max(axis=0)
    if robot is None:
        k = int(np.argmax(largest))
        if largest[k] > 4 * np.pi and np.ptp(q[:, k]) > 4 * np.pi:
            return [
                f"q{k + 1} reaches {largest[k]:.4g} rad, {largest[k] / 2 / np.pi:.1f} turns: "
                "positions may be in degrees (units={'q': 'deg'})."
            ]
        return []
    turning = np.array([kind == "revolute" for kind in robot.joint_types])
    limits = np.abs(np.asarray(robot.position_limits)).max(axis=1)
    limits = np.where(np.isfinite(limits), limits, 2 * np.pi)
    outside = turning & (largest > 1.5 * limits)
    if outside.any() and np.all(largest[turning] * DEGREE <= 1.1 * limits[turning]):
        k = int(np.argmax(np.where(outside, largest / limits, 0)))
        return [
            f"q{k + 1} ({robot.joint_names[k]}) reaches {largest[k]:.4g} rad where the limit is "
            f"{limits[k]:.3g} rad; read as degrees it would be {largest[k] * DEGREE:.3g} rad. "
            "Positions look like degrees (units={'q': 'deg'}, and 'dq': 'deg/s' if alike)."
        ]
    return []


def _slope_message(joint: JointQuality) -> str | None:
    """What a slope of integrated velocity on position other than 1 speaks for."""
    slope, correlation = joint.velocity_slope, joint.velocity_correlation
    if not np.isfinite(slope) or not joint.excited or abs(slope - 1) < 0.1:
        return None
    evidence = (
        f"the velocity of {joint.name} is {slope:.4g} times its differentiated position "
        f"(correlation {correlation:.3f})"
    )
    if correlation > 0.9:
        for factor, unit in CLOCKS.items():
            if abs(slope / factor - 1) < 0.1:
                return f"{evidence}: time looks like {unit} (units={{'time': '{unit}'}})."
        if abs(slope * DEGREE - 1) < 0.1:
            return f"{evidence}: velocities look like deg/s (units={{'dq': 'deg/s'}})."
        if abs(slope / DEGREE - 1) < 0.1:
            return f"{evidence}: positions look like degrees (units={{'q': 'deg'}})."
    return f"{evidence}: it is not the derivative of the position."


def _currents(
    q: np.ndarray,
    dq: np.ndarray,
    tau: np.ndarray,
    time: np.ndarray,
    trajectory: np.ndarray,
    robot: Robot,
) -> list[str]:
    """Torques that follow the robot's own, but at another scale on every loaded joint."""
    rows = slice(0, 20_000)
    rigid, measured, friction = [], [], []
    low_pass = butter(2, 0.1, output="sos")
    for part in find_segments(trajectory[rows], time[rows]):
        if part.stop - part.start < 30:
            continue
        speed = sosfiltfilt(low_pass, dq[part], axis=0)
        ddq = np.gradient(speed, time[part], axis=0)
        rigid.append(robot.inverse_dynamics(q[part], dq[part], ddq))
        measured.append(tau[part])
        friction.append(speed)
    if not rigid:
        return []
    model, y, speed = map(np.concatenate, (rigid, measured, friction))
    scales, joints = [], []
    for k in range(q.shape[1]):
        sign = np.tanh(speed[:, k] / (0.01 * np.abs(speed[:, k]).max() + 1e-12))
        others = np.column_stack([speed[:, k], sign, np.ones(len(y))])
        basis, _ = np.linalg.qr(others)
        x = model[:, k] - basis @ (basis.T @ model[:, k])
        z = y[:, k] - basis @ (basis.T @ y[:, k])
        if x @ x == 0 or z @ z == 0 or (x @ z) / np.sqrt((x @ x) * (z @ z)) < 0.9:
            continue
        scales.append(float(x @ z / (x @ x)))
        joints.append(k)
    if not scales or not (max(scales) < 0.4 or min(scales) > 2.5):
        return []
    told = ", ".join(
        f"{robot.joint_names[k]} {scale:.3g}" for k, scale in zip(joints, scales, strict=True)
    )
    return [
        f"torques follow the robot's rigid-body torque at another scale ({told}): they look like "
        "motor currents or another unit. Pass the torque per ampere with drive_gains=[...] and "
        "columns={'i': [...]}, or units={'tau': ...}."
    ]
