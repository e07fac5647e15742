# SPDX-License-Identifier: BSD-3-Clause
"""Measures of single signals of a log, used by its quality report."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import butter, sosfiltfilt

if TYPE_CHECKING:
    from skidyn.robots import Robot

#: Windows over which velocity is compared with differentiated position, s.
WINDOW = 0.05
#: Largest delay that is looked for, s, and the rows used for it.
LARGEST_DELAY = 0.05
DELAY_ROWS = 8_000


def position_step(position: np.ndarray) -> float:
    """Step of a position sensor, or NaN where positions are not visibly quantised.

    Gaps between neighbouring distinct values are whole multiples of the step of the sensor.
    """
    gaps = np.diff(np.unique(position))
    gaps = gaps[gaps > 1e-12]
    if len(gaps) < 20:
        return np.nan
    smallest = np.sort(gaps)[: max(len(gaps) // 50, 5)]
    step = float(np.median(smallest))
    if step < 0.8 * smallest[-1] or smallest[0] < 0.8 * step:
        return np.nan
    largest = float(np.abs(position).max())
    if step < 8 * np.finfo(np.float32).eps * largest and np.all(position == np.float32(position)):
        return np.nan  # the step of the numbers in the file, not of the sensor
    multiples = gaps[gaps < 20 * step] / step
    whole = np.abs(multiples - np.round(multiples)) < 0.1
    return step if whole.mean() > 0.9 else np.nan


def repeated_rows(position: np.ndarray, velocity: np.ndarray, trajectory: np.ndarray) -> int:
    """Number of rows in which no position changes although some joint moves."""
    same = np.all(position[1:] == position[:-1], axis=1) & (trajectory[1:] == trajectory[:-1])
    moving = np.any(np.abs(velocity[1:]) > 0.02 * np.abs(velocity).max(axis=0), axis=1)
    return int(np.sum(same & moving))


def rest_share(velocity: np.ndarray) -> float:
    """Share of rows in which a joint stands: below 0.5 % of its largest velocity."""
    largest = np.abs(velocity).max()
    return float(np.mean(np.abs(velocity) <= 0.005 * largest)) if largest > 0 else 1.0


def reversals(velocity: np.ndarray, segments: Sequence[slice]) -> int:
    """Changes of direction, with a dead band of 2 % of the largest velocity against noise."""
    band = 0.02 * np.abs(velocity).max()
    count = 0
    for rows in segments:
        moving = velocity[rows][np.abs(velocity[rows]) > band]
        count += int(np.sum(np.signbit(moving[1:]) != np.signbit(moving[:-1])))
    return count


def longest_plateau_share(torque: np.ndarray, segments: Sequence[slice]) -> float:
    """Share of rows in runs of five or more at the extreme value of the torque."""
    span = np.ptp(torque)
    if span == 0:
        return 1.0
    at_limit = (torque >= torque.max() - 1e-6 * span) | (torque <= torque.min() + 1e-6 * span)
    rows = 0
    for part in segments:
        edges = np.flatnonzero(np.diff(np.r_[0, at_limit[part].astype(int), 0]))
        lengths = edges[1::2] - edges[::2]
        rows += int(lengths[lengths >= 5].sum())
    return rows / len(torque)


def velocity_consistency(
    time: np.ndarray, position: np.ndarray, velocity: np.ndarray, segments: Sequence[slice]
) -> tuple[float, float]:
    """Slope and correlation of integrated velocity against change of position.

    Both are taken over windows of 50 ms (in samples of the median step), which averages noise and
    quantisation out. NaN where the joint does not move.
    """
    steps = np.concatenate([np.diff(time[rows]) for rows in segments])
    if len(steps) == 0:
        return np.nan, np.nan
    window = int(np.clip(np.round(WINDOW / np.median(steps)), 1, 50))
    change, integral = [], []
    for rows in segments:
        t, q, dq = time[rows], position[rows], velocity[rows]
        if len(t) <= window:
            continue
        area = np.r_[0.0, np.cumsum((dq[1:] + dq[:-1]) / 2 * np.diff(t))]
        change.append(q[window:] - q[:-window])
        integral.append(area[window:] - area[:-window])
    if not change:
        return np.nan, np.nan
    x, y = np.concatenate(change), np.concatenate(integral)
    if x @ x < 1e-20 or y @ y < 1e-20:
        return np.nan, np.nan
    return float(x @ y / (x @ x)), float(x @ y / np.sqrt((x @ x) * (y @ y)))


def excited(position: np.ndarray, velocity: np.ndarray, segments: Sequence[slice]) -> bool:
    """Whether a joint moves at all: more than 100 steps of noise, in both directions."""
    span = np.ptp(position)
    noise = np.median(np.abs(np.diff(position, n=2))) if len(position) > 2 else 0.0
    return bool(span > 1e-3 and span > 20 * noise and reversals(velocity, segments) > 0)


def torque_delay(
    time: np.ndarray,
    q: np.ndarray,
    dq: np.ndarray,
    tau: np.ndarray,
    segments: Sequence[slice],
    robot: Robot,
) -> np.ndarray:
    """Lag of the torque behind the motion, per joint.

    The torque is shifted against the columns of the rigid-body regressor, friction and rotor
    inertia; the lag is where the residual of their fit is least. Both are low-passed alike at a
    tenth of the sampling rate.

    Parameters
    ----------
    time : ndarray of shape (n_samples,), s
        Clock.
    q, dq, tau : ndarray of shape (n_samples, n_joints)
        Motion and torque.
    segments : sequence of slice
        Runs of rows without a gap.
    robot : Robot
        Its kinematics give the columns; inertial parameters are not used.

    Returns
    -------
    ndarray of shape (n_joints,), s
        Positive where torque is late; NaN where the fit explains less than half of the torque's
        variance, or where the least residual lies at the edge of +-50 ms.
    """
    n = q.shape[1]
    parts = _delay_rows(segments)
    if not parts:
        return np.full(n, np.nan)
    step = float(np.median(np.concatenate([np.diff(time[part]) for part in parts])))
    reach = int(min(LARGEST_DELAY / step, 12))
    if reach < 1:
        return np.full(n, np.nan)
    low_pass = butter(2, 0.2, output="sos")
    columns, torques = [], []
    for part in parts:
        ddq = np.gradient(sosfiltfilt(low_pass, dq[part], axis=0), time[part], axis=0)
        rigid = robot.torque_regressor(q[part], dq[part], ddq)
        speed = 0.01 * np.abs(dq[part]).max(axis=0) + 1e-12
        own = np.stack([dq[part], np.tanh(dq[part] / speed), ddq], axis=2)
        block = sosfiltfilt(low_pass, np.concatenate([rigid, own], axis=2), axis=0)
        columns.append(block[reach : len(block) - reach])
        torques.append(sosfiltfilt(low_pass, tau[part], axis=0))
    A = np.concatenate(columns)
    return step * np.array([_best_shift(A[:, k], torques, k, reach) for k in range(n)])


def _delay_rows(segments: Sequence[slice]) -> list[slice]:
    """Stretches of the longest segments, few enough rows for a quick fit."""
    parts: list[slice] = []
    for segment in sorted(segments, key=lambda s: s.start - s.stop):
        room = DELAY_ROWS - sum(part.stop - part.start for part in parts)
        if segment.stop - segment.start < 60 or room < 60:
            break
        parts.append(slice(segment.start, min(segment.stop, segment.start + min(room, 2000))))
    return parts


def _best_shift(A: np.ndarray, torques: Sequence[np.ndarray], joint: int, reach: int) -> float:
    """Shift of least residual in samples, by a parabola through the three best."""
    used = A[:, np.abs(A).max(axis=0) > 0]
    basis, _ = np.linalg.qr(np.column_stack([used, np.ones(len(A))]))
    shifts = np.arange(-reach, reach + 1)
    errors = []
    for shift in shifts:
        y = np.concatenate([t[reach + shift : len(t) - reach + shift, joint] for t in torques])
        spread = float(np.sum((y - y.mean()) ** 2))
        residual = float(y @ y - np.sum((basis.T @ y) ** 2))
        errors.append(residual / spread if spread > 0 else 1.0)
    best = int(np.argmin(errors))
    if errors[best] > 0.5 or best in (0, len(shifts) - 1):
        return np.nan
    left, middle, right = errors[best - 1 : best + 2]
    bend = left - 2 * middle + right
    return float(shifts[best] + (0.5 * (left - right) / bend if bend > 0 else 0.0))
