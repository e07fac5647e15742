# SPDX-License-Identifier: BSD-3-Clause
"""Rows that repeat the one before: the recorder polled faster than the robot reports."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidyn._sensor_steps import position_step
from skidyn._signals import Signals

#: Share of rows that repeat the previous one from which it is no accident.
REPEATED = 0.02
#: Most steps of a sensor by which a position changes after rows that repeat because it is coarse.
STEPS = 3.0
#: Share of the rows of a joint that keep their position for which all joints keep theirs at once.
AT_ONCE = 0.7
#: Share of the distance that its velocity implies by which a position that was held moves on.
CAUGHT = 0.3
#: The same in smallest changes of it: a joint may begin to move by one step of its sensor.
ONE_STEP = 1.5


def repeated_rows(signals: Signals) -> NDArray[np.bool_]:
    """Rows with the positions of the previous row although joints move, (n_samples,)."""
    found: NDArray[np.bool_] = signals.once(
        "repeated rows", lambda: is_repeated(signals.q, signals.dq, signals.trajectory)
    )
    return found


def stale_rows(signals: Signals) -> NDArray[np.bool_]:
    """Repeated rows of a log that has many of them, and not because its sensors are coarse.

    Parameters
    ----------
    signals : Signals
        Logged motion.

    Returns
    -------
    ndarray of shape (n_samples,) of bool
        Rows that say nothing of the positions at their time.
    """
    again = repeated_rows(signals)
    if again.sum() <= REPEATED * signals.n_samples or moves_by_steps(signals):
        return np.zeros_like(again)
    return again


def moves_by_steps(signals: Signals) -> bool:
    """Whether positions mostly change by a few steps of their sensors, and else not at all.

    After repeated rows, positions change by all the missed motion.
    """
    return bool(signals.once("moves by steps", lambda: _by_steps(signals)))


def _by_steps(signals: Signals) -> bool:
    sizes = []
    for position in signals.q.T:
        changes, step = np.abs(np.diff(position)), position_step(position)
        if np.isfinite(step) and changes.any():
            sizes.append(float(np.median(changes[changes > 0])) / step)
    return bool(sizes) and bool(np.median(sizes) <= STEPS)


def is_repeated(position: np.ndarray, velocity: np.ndarray, trajectory: np.ndarray) -> np.ndarray:
    """Rows in which no position changes although some joint moves, as a mask."""
    again = np.zeros(len(position), dtype=bool)
    same = np.all(position[1:] == position[:-1], axis=1) & (trajectory[1:] == trajectory[:-1])
    if not same.any():
        return again
    # a velocity that never changes was not measured
    fast = np.where(np.ptp(velocity, axis=0) > 0, 0.02 * np.abs(velocity).max(axis=0), np.inf)
    moving = np.any(np.abs(velocity[1:]) > fast, axis=1)
    again[1:] = same & moving
    again[1:] &= _caught_up(position, velocity, trajectory, same)[1:]
    # a coarse sensor holds its value too, but each joint by itself
    single = np.mean(position[1:] == position[:-1], axis=0)
    single = single[np.ptp(position, axis=0) > 0]
    at_once = len(single) < 2 or same.mean() > AT_ONCE * np.median(single)
    return again if at_once else np.zeros_like(again)


def _caught_up(
    position: np.ndarray, velocity: np.ndarray, trajectory: np.ndarray, same: np.ndarray
) -> np.ndarray:
    """Rows after which positions move on by more than in one step, as a mask.

    Joints at rest whose velocity is late or noisy do not, nor does a sensor that moves on by one of
    its steps.
    """
    moved = np.abs(np.diff(position, axis=0))
    moved[trajectory[1:] != trajectory[:-1]] = 0
    fresh = np.flatnonzero(~same)  # steps in which positions change, or trajectories
    after = np.searchsorted(fresh, np.arange(len(same)))
    step = np.zeros_like(moved)
    known = after < len(fresh)
    step[known] = moved[fresh[after[known]]]
    speed = np.abs(velocity[1:])
    slow = np.sum(speed[~same], axis=0)
    usual = np.sum(moved[~same], axis=0) / np.where(slow > 0, slow, 1.0)
    least = np.min(moved, axis=0, where=moved > 0, initial=np.inf)
    caught = np.zeros(len(position), dtype=bool)
    further = (step > CAUGHT * usual * speed) & (step > ONE_STEP * least)
    caught[1:] = np.any(further & (speed > 0), axis=1)
    return caught
