# SPDX-License-Identifier: BSD-3-Clause
"""Broken samples: values that jump away from their neighbours and back, and torn motion.

A dropped packet, a bus error or a reset register leaves one to three samples with wrong values.
They are found by their distance from a running median (Hampel 1974, JASA 69), which a step of the
torque at a reversal does not increase. Motion is torn where a position jumps, or where the logged
velocity is for a moment not its derivative, as where all values of a packet are held, or at the
ends of a recording that was filtered there. Such samples are left out of the rows, and the user is
informed: one wrong acceleration may weigh more than a whole recording.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from skidyn._signals import Array, Signals
from skidyn._text import listed
from skidyn.evidence._kinematics import smooth_motion
from skidyn.evidence._rows import widened

#: Samples of the running median; up to three of them may be broken.
WIDTH = 7
#: A broken sample is further from the median than this many times the distance between these
#: quantiles of all such distances in its trajectory,
FAR, TAILS = 3.0, (0.02, 0.98)
#: and than this share of the range of the signal itself.
TORQUE_SHARE, POSITION_SHARE = 0.25, 0.05
#: and than this many steps of a coarse sensor; at rest such a sensor changes by one or two steps.
STEPS = 5.0
#: A position jumps where its distance from the line between its neighbours is more than this many
#: times the median and the highest hundredth of all such distances, and this many steps of a coarse
#: sensor,
JUMP_OVER_MEDIAN, JUMP_OVER_TAIL, JUMP_STEPS = 30.0, 10.0, 3.0
#: and more than this share of the same distance with neighbours that are so many samples away:
#: it is 1/16 where the acceleration is constant, 1/4 where the velocity jumps, and 1 for a jump.
JUMP_SHARE, JUMP_LAG = 0.5, 4
#: Samples between two jumps that are no more than so many apart are wrong, too.
AWAY = 50
#: A velocity is compared with the change of the position from so many samples before to as many
#: after, and differs by more than this share of the range of velocities. Where the velocity jumps
#: from one end of that range to the other, the difference is 1/24 of it. At the ends of a recording
#: where it differs by this share of that limit, it is compared with that of the smoothed position,
#: which shows more of what a filter did there.
REACH, VELOCITY_SHARE, BENT = 6, 0.05, 0.5


def leaps(
    values: Array, signals: Signals, share: float, turns: NDArray[np.bool_] | None = None
) -> NDArray[np.bool_]:
    """Samples that jump away from their neighbours and back.

    Parameters
    ----------
    values : ndarray of shape (n_samples, n_joints)
        Torque or position.
    signals : Signals
        Motion, with the borders of trajectories and the gaps.
    share : float
        Least size of a jump as a share of the range of the signal in its trajectory.
    turns : ndarray of shape (n_samples, n_joints) of bool, optional
        Samples at which the signal may jump by its full range, as at reversals.

    Returns
    -------
    ndarray of shape (n_samples, n_joints) of bool
    """
    least = _least(values, signals, share, turns)
    broken = np.zeros(values.shape, dtype=bool)
    # Most signals have no leap, and then this is all that is computed.
    if not (_farthest_from_median(values, signals.segments) > least).any():
        return broken
    away = np.zeros_like(values)
    for rows in _long_enough(signals.segments):
        away[rows] = values[rows] - _running_median(values[rows])
    distance = np.abs(away)
    far = distance > least
    if not far.any():
        return broken
    coarse = STEPS * _smallest_change(values)
    for name in np.unique(signals.trajectory[far.any(axis=1)]):
        own = signals.trajectory == name
        spread = _range(away[own])
        broken[own] = far[own] & (distance[own] > np.maximum(FAR * spread, coarse))
    return broken


def _least(values: Array, signals: Signals, share: float, turns: NDArray[np.bool_] | None) -> Array:
    """Distance from the running median above which a sample may be broken."""
    names = np.unique(signals.trajectory[[rows.start for rows in signals.segments]])
    # One that rests for most of a recording has a small range there.
    whole = _range(values)
    least = np.empty_like(values)
    least[:] = share * whole
    for name in names if len(names) > 1 else ():
        own = signals.trajectory == name
        least[own] = share * _range(values[own])
    if turns is not None:
        np.copyto(least, whole, where=turns)
    # At either end of a trajectory a step cannot be distinguished from a jump and back.
    for rows in signals.segments:
        for end in (slice(0, WIDTH // 2), slice(-(WIDTH // 2), None)):
            least[rows][end] = whole
    return least


def _range(values: Array) -> Array:
    """Range of each column without its tails."""
    bottom, top = np.quantile(values, TAILS, axis=0)
    return np.asarray(top - bottom)


def _long_enough(segments: Iterable[slice]) -> list[slice]:
    """Segments that have a running median."""
    return [rows for rows in segments if rows.stop - rows.start >= 2 * WIDTH]


def _padded(values: Array) -> Array:
    """Values reflected at either end."""
    middle = WIDTH // 2
    return np.concatenate([values[:middle][::-1], values, values[-middle:][::-1]])


def _running_median(values: Array) -> Array:
    """Running median of each column, reflected at either end."""
    windows = sliding_window_view(_padded(values), WIDTH, axis=0)
    return np.asarray(np.partition(windows, WIDTH // 2, axis=-1)[..., WIDTH // 2])


def _farthest_from_median(values: Array, segments: Iterable[slice]) -> Array:
    """No less than the distance of every sample from the running median.

    More than half of a window is on the same side of a sample as the median and no nearer. So are
    both samples of at least one of the pairs that are equally far before and after it, and then
    their mean.
    """
    middle = WIDTH // 2
    farthest = np.zeros_like(values)
    for rows in _long_enough(segments):
        padded, n, own = _padded(values[rows]), rows.stop - rows.start, values[rows]
        for lag in range(1, middle + 1):
            before, after = (padded[middle + way :][:n] for way in (-lag, lag))
            mean = (before + after) / 2
            np.maximum(farthest[rows], np.abs(mean - own), out=farthest[rows])
    return farthest


def _smallest_change(values: Array) -> Array:
    """A small change between neighbouring samples, by column: the step of a coarse sensor."""
    changes = np.abs(np.diff(values, axis=0))
    return np.array([np.quantile(c[c > 0], 0.05) if (c > 0).any() else 0.0 for c in changes.T])


def reversals(signals: Signals) -> NDArray[np.bool_]:
    """Samples near a change of direction, at which dry friction may jump and jump back.

    Parameters
    ----------
    signals : Signals
        Logged motion.

    Returns
    -------
    ndarray of shape (n_samples, n_joints) of bool
    """
    turns = np.zeros(signals.dq.shape, dtype=bool)
    turns[1:] = np.diff(np.sign(signals.dq), axis=0) != 0
    return widened(turns, WIDTH // 2)


def without_broken(motion: Signals, logged: Signals, torque: Array) -> Signals:
    """Mark as invalid the samples with broken torque and those that a broken position affects.

    Parameters
    ----------
    motion : Signals
        Smoothed motion.
    logged : Signals
        Motion before smoothing.
    torque : ndarray of shape (n_samples, n_joints)
        Logged torque.
    """
    wrong, broken = _broken(logged, torque)
    # The torque of every joint depends on all positions.
    position = np.asarray((broken | torn(logged)).any(1))
    if position.any():
        position = widened(position, max(1, motion.half_width))
    return motion.with_(valid=motion.usable & ~wrong & ~position[:, None])


def torn(signals: Signals) -> NDArray[np.bool_]:
    """Samples at which positions jump, or velocities are for a moment not their derivatives.

    Parameters
    ----------
    signals : Signals
        Logged motion with a clock.

    Returns
    -------
    ndarray of shape (n_samples, n_joints) of bool
    """
    found: NDArray[np.bool_] = signals.once(
        "torn motion", lambda: _jumps(signals) | _other_velocity(signals)
    )
    return found


def _jumps(signals: Signals) -> NDArray[np.bool_]:
    """Samples at which a position leaves the line between its neighbours, and those in between."""
    near, far = (_off_line(signals, lag) for lag in (1, JUMP_LAG))
    jump = near > JUMP_SHARE * far
    if jump.any():
        jump &= near > JUMP_OVER_TAIL * np.quantile(near, 0.99, axis=0)
    if jump.any():
        jump &= near > JUMP_OVER_MEDIAN * np.median(near, axis=0)
        jump &= near > JUMP_STEPS * _smallest_change(signals.q)
    for k in np.flatnonzero(jump.any(axis=0)):
        for last, first in pairwise(np.flatnonzero(jump[:, k])):
            jump[last:first, k] |= first - last <= AWAY
    return np.asarray(jump)


def _off_line(signals: Signals, lag: int) -> Array:
    """Distance of positions from the line between those some samples before and after.

    It is 0 near the ends of a segment, where there is no such line.
    """
    distance = np.zeros_like(signals.q)
    for rows in signals.segments:
        q, clock = signals.q[rows], signals.clock[rows]
        if len(q) <= 2 * JUMP_LAG:
            continue
        here = slice(JUMP_LAG, len(q) - JUMP_LAG)
        before, after = (slice(here.start + way, here.stop + way) for way in (-lag, lag))
        share = (clock[here] - clock[before]) / np.maximum(clock[after] - clock[before], 1e-300)
        line = q[before] + share[:, None] * (q[after] - q[before])
        distance[rows][here] = np.abs(q[here] - line)
    return distance


def _other_velocity(signals: Signals) -> NDArray[np.bool_]:
    """Samples around which the logged velocity is not that with which the position changes."""
    off = _velocity_error(signals)
    least = VELOCITY_SHARE * np.ptp(signals.dq, axis=0)
    if not (np.abs(off) > BENT * least).any():
        return np.zeros(off.shape, dtype=bool)
    least = np.maximum(FAR * _range(off), least)
    off = np.abs(off)
    other = off > least
    smoothed = signals.once("smooth motion", lambda: smooth_motion(signals))
    apart = np.abs(signals.dq - smoothed.dq)
    for rows in signals.segments:
        for end in (slice(0, smoothed.half_width), slice(-smoothed.half_width, None)):
            bent = off[rows][end].max(axis=0, initial=0.0) > BENT * least
            other[rows][end] |= (apart[rows][end] > least) & bent
    beside = np.zeros_like(other)
    beside[1:] |= other[:-1]
    beside[:-1] |= other[1:]
    other &= beside  # a single sample is one of noise
    if other.any():
        step = _smallest_change(signals.q) * signals.rate / (2 * REACH)
        other &= np.maximum(off, apart) > JUMP_STEPS * step
    return np.asarray(other)


def _velocity_error(signals: Signals) -> Array:
    """Change of the position around every sample minus that by the velocity, over the time of it.

    Shape (n_samples, n_joints), rad/s or m/s.
    """
    off = np.zeros_like(signals.q)
    for rows in signals.segments:
        q, dq, clock = signals.q[rows], signals.dq[rows], signals.clock[rows]
        moved = np.zeros_like(q)
        np.cumsum((dq[1:] + dq[:-1]) / 2 * np.diff(clock)[:, None], axis=0, out=moved[1:])
        place = np.clip(np.arange(-REACH, len(q) + REACH), 0, len(q) - 1)
        apart, time = (q - moved)[place], clock[place]
        time = np.maximum(time[2 * REACH :] - time[: -2 * REACH], 1e-300)
        off[rows] = (apart[2 * REACH :] - apart[: -2 * REACH]) / time[:, None]
    return off


def _broken(signals: Signals, torque: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Broken samples of torque and of positions, found once for the same signals."""

    def find() -> NDArray[np.bool_]:
        return leaps(torque, signals, TORQUE_SHARE, reversals(signals))

    of, wrong = signals.once("broken torque", lambda: (torque, find()))
    position = signals.once("broken positions", lambda: leaps(signals.q, signals, POSITION_SHARE))
    return wrong if of is torque else find(), position


def without_broken_positions(signals: Signals) -> Signals:
    """Signals with broken positions replaced by linear interpolation.

    Parameters
    ----------
    signals : Signals
        Logged motion.

    Returns
    -------
    Signals
        The same object if no position is broken.
    """
    broken = signals.once("broken positions", lambda: leaps(signals.q, signals, POSITION_SHARE))
    if not broken.any():
        return signals
    q = signals.q.copy()
    for rows in signals.segments:
        for k in np.flatnonzero(broken[rows].any(axis=0) & ~broken[rows].all(axis=0)):
            bad, clock = broken[rows, k], signals.clock[rows]
            q[rows.start + np.flatnonzero(bad), k] = np.interp(
                clock[bad], clock[~bad], signals.q[rows, k][~bad]
            )
    return signals.with_(q=q)


def broken_notes(
    signals: Signals, torque: Array, joint_names: tuple[str, ...]
) -> list[tuple[str, str]]:
    """What is wrong with broken samples, and which samples these are.

    Parameters
    ----------
    signals : Signals
        Logged motion.
    torque : ndarray of shape (n_samples, n_joints)
        Logged torque, N m or N.
    joint_names : tuple of str
        Names of the joints.

    Returns
    -------
    list of (str, str)
        The two parts of a sentence for every joint and signal with broken samples.
    """
    if signals.time is None:
        return []
    notes = []
    wrong, position = _broken(signals, torque)
    for what, values, broken in (("torque", torque, wrong), ("position", signals.q, position)):
        for j in np.flatnonzero(broken.any(0)):
            rows = np.flatnonzero(broken[:, j])
            first = rows[0]
            near = np.median(values[max(0, first - WIDTH) : first + WIDTH, j])
            where = f"{_counted(rows)}: {values[first, j]:.4g} among {near:.4g}); left out"
            notes.append((f"the {what} of joint {j + 1} ({joint_names[j]}) has outliers", where))
    # a broken position tears the motion around it, too
    reach = max(1, signals.once("smooth motion", lambda: smooth_motion(signals)).half_width)
    elsewhere = torn(signals) & ~widened(position, reach)
    joints = np.flatnonzero(elsewhere.any(0))
    if len(joints):
        names = listed([f"joint {j + 1} ({joint_names[j]})" for j in joints])
        where = f"{_counted(np.flatnonzero(elsewhere.any(1)))}); left out with their surroundings"
        notes.append((f"the position of {names} jumps or disagrees with the velocity", where))
    return notes


def _counted(rows: NDArray[np.intp]) -> str:
    """Number of samples, and the first of them."""
    count = f"{len(rows)} samples" if len(rows) > 1 else "1 sample"
    return f"in {count} (the first in row {rows[0]}"
