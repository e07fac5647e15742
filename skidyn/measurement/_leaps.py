# SPDX-License-Identifier: BSD-3-Clause
"""Positions that jump and remain there, as where recordings were joined."""

from __future__ import annotations

import numpy as np

from skidyn.measurement._wraps import TURN, wrap_period

#: Least size of a jump of a position: as a multiple of its steps before and after, as a multiple of
#: the deviation from even motion, and as a share of its range; most joined places,
#: as a share of the rows.
FARTHER, BEYOND, RANGE, PLACES = 4.0, 8.0, 1e-3, 2e-3
#: Range in rad or m within which a joint rests.
RESTS = 2e-3
#: Most steps that a position may be held before it catches up.
CATCH_UP = 5
#: Most rows after which a position jumps back to its course, and how many times as far as its steps
#: around imply it may then be from where it left it: for this long, its values were wrong.
AWAY, ONWARD = 50, 2.0


def find_leaps(q: np.ndarray, time: np.ndarray, trajectory: np.ndarray) -> np.ndarray:
    """Rows to which positions jump from the previous row and remain there.

    Parameters
    ----------
    q : ndarray of shape (n_samples, n_joints), rad or m
        Recorded positions.
    time : ndarray of shape (n_samples,), s
        Recorded clock.
    trajectory : ndarray of shape (n_samples,)
        Trajectory of every row.

    Returns
    -------
    ndarray of int
        Empty if no position jumps, or too many do for joined recordings.
    """
    n = len(q)
    if n < 20:
        return np.zeros(0, dtype=np.intp)
    step = np.diff(time)
    usual = float(np.median(step[step > 0])) if np.any(step > 0) else 1.0
    together = (trajectory[1:] == trajectory[:-1]) & (step < 3 * usual) & (step > 0)
    moved = np.where(together[:, None], np.diff(q, axis=0), 0.0)
    far = np.zeros(moved.shape, dtype=bool)
    for joint in range(moved.shape[1]):
        far[:, joint] = _jumps(moved[:, joint], q[:, joint], trajectory)
    kept: list[int] = []
    back: set[int] = set()
    for row in np.flatnonzero(far.any(axis=1) & together):
        joints = np.flatnonzero(far[row])
        if row in back:
            continue
        same = slice(0, row + int(np.argmin(np.append(trajectory[row:] == trajectory[row], False))))
        if ends_wrong := {end for k in joints if (end := _end_of_wrong(q[same, k], int(row)))}:
            back |= ends_wrong
            continue
        ends = np.array([max(0, row - 4), min(n - 1, row + 5)], dtype=np.intp)
        if np.ptp(np.unique(trajectory[ends], return_inverse=True)[1]):
            continue  # too close to the end of a trajectory for two parts
        if _was_held(moved, int(row)):
            continue  # rows without new values, after which all joints are where they should be
        stay = []
        for k in joints:
            before, after = q[max(0, row - 4) : row + 1, k], q[row + 1 : row + 6, k]
            leap = abs(q[row + 1, k] - q[row, k])
            stay.append(abs(np.median(after) - np.median(before)) > 0.5 * leap)
        if any(stay):
            kept.append(int(row) + 1)
    few = len(kept) + len(back) <= max(PLACES * n, 2)
    return np.array(kept if few else [], dtype=np.intp)


def _end_of_wrong(position: np.ndarray, row: int) -> int:
    """Step with which a position returns to the course that it left with step ``row``; 0 if none.

    A step is that from the row of its number to the next one.
    """
    before = np.abs(np.diff(position[max(0, row - 3) : row + 1])).max(initial=0.0)
    step = np.abs(np.diff(position[row : row + AWAY + 4]))
    for later in range(1, len(step) - 3):
        around = max(before, step[later + 1 : later + 4].max())
        way = abs(position[row + later + 1] - position[row])
        if step[later] > FARTHER * around and way <= ONWARD * (later + 1) * around:
            return row + later
    return 0


def _was_held(moved: np.ndarray, row: int) -> bool:
    """Whether a step makes up for the steps before, in which no joint moved."""
    moving = np.flatnonzero(moved[:row].any(axis=1))
    held = row - 1 - int(moving[-1]) if len(moving) else 0
    if not held:
        return False
    start = row - held
    around = np.abs(np.concatenate([moved[max(0, start - 3) : start], moved[row + 1 : row + 4]]))
    return bool(np.all(np.abs(moved[row]) <= FARTHER * (1 + held) * around.max(axis=0)))


def _jumps(moved: np.ndarray, q: np.ndarray, trajectory: np.ndarray) -> np.ndarray:
    """Steps of a position that are far longer than those before and after, but for wrapped ones."""
    # not than by the recorded velocity, whose unit may be another
    around = np.stack([np.roll(moved, shift) for shift in (-3, -2, -1, 1, 2, 3)])
    most = np.abs(around).max(axis=0)
    far = np.abs(moved) > FARTHER * most
    if not far.any():
        return np.asarray(far)  # as in most logs
    # a joint that rests moves by a step of its encoder now and then
    if np.ptp(q) < RESTS:
        far &= np.abs(moved) > FARTHER * np.abs(moved[moved != 0]).min(initial=np.inf)
    # a position that was held catches up in one step
    far &= np.abs(moved) > FARTHER * (1 + _held_before(moved)) * most
    around.sort(axis=0)
    beyond = np.abs(moved - (around[2] + around[3]) / 2)
    far &= beyond > BEYOND * np.quantile(beyond, 0.995)
    far &= beyond > RANGE * np.ptp(q)
    for turn in {TURN, wrap_period(q, trajectory) or TURN} if far.any() else ():
        turns = np.abs(moved - turn * np.round(moved / turn)) < 0.05 * turn
        far &= ~(turns & (np.abs(moved) > turn / 2))
    return np.asarray(far)


def _held_before(moved: np.ndarray) -> np.ndarray:
    """Number of steps without motion among the last ``CATCH_UP`` before every step."""
    held = np.zeros(moved.shape, dtype=int)
    still = np.ones(moved.shape, dtype=bool)
    for back in range(1, CATCH_UP + 1):
        still[:back] = False
        still[back:] &= moved[:-back] == 0
        held += still
    return held
