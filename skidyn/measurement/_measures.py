# SPDX-License-Identifier: BSD-3-Clause
"""Measures of single signals of a log, used by its quality report."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from skidyn._sensor_steps import step_of_values
from skidyn._signals import runs_of

#: Least step of a coarse position, rad: a turn in 13 bits.
COARSE = 0.9 * 2 * np.pi / 2**13
#: Samples between positions whose differences show reversals.
STRIDE = 10
#: Least change, in steps of the sensor, of a position that was held for several rows.
CATCHES = 3.0
#: Values among those that follow a change from which most are new, and not those of a few steps.
RECURS = 0.5
#: Least share of rows that hold all torques to be reported, and of those that hold any.
HELD, AT_ONCE = 0.2, 0.7
#: Share of zeros among torques above which zeros are normal; travel of a joint, as a share of its
#: range, during which constant torques are not measured.
MOSTLY_ZERO, IDLE_WAY = 0.3, 0.01
#: Least rows, and time in s, at an end of a recording without changes of torque, to be reported.
IDLE_ROWS, IDLE_TIME = 8, 0.05
#: Share of rows with missing values that is certain to be harmful.
MANY_MISSING = 0.01
#: Fewest places with zeros instead of missing torques; least ratio of the torque beside them to
#: the median torque: near a true zero it is small.
FEWEST_MISSING, JUMPS = 5, 0.4
#: How many times as many zeros as torques one step beside zero are more than those of a coarse
#: torque.
MORE_ZEROS = 2.0
#: Most values of a channel that is coarse in any case.
FEW_VALUES = 64
#: Fewest values of a torque that is not coarse.
FINE = 50
#: Fewest rows of one value that are a plateau of a torque.
PLATEAU = 5
#: How many times as long as 95 % of the parts with the same torques a part is in which these were
#: lost, share of the torques that change before and after it, and fewest such parts.
LOST, MOST_CHANGE, FEWEST_LOST = 4, 0.7, 2


def channel_step(values: np.ndarray) -> float:
    """Step of a channel with few values, or of a coarse sensor; NaN if it is not coarse."""
    distinct = np.unique(values)
    if 2 < len(distinct) <= min(FEW_VALUES, len(values) // 2):  # which recur
        return float(np.median(np.diff(distinct)))
    return step_of_values(distinct)


def step_share(values: np.ndarray, step: float) -> float:
    """Step of a channel as a share of its standard deviation; 0 if it has none, or is constant."""
    spread = float(values.std())
    return step / spread if np.isfinite(step) and spread else 0.0


def held_share(position: np.ndarray, within: np.ndarray, step: float) -> float:
    """Share of steps in which a moving position does not change, and then catches up.

    Parameters
    ----------
    position : ndarray of shape (n_samples,), rad or m
        Of one joint.
    within : ndarray of shape (n_samples - 1,) of bool
        Steps within a trajectory.
    step : float, rad or m
        Of the sensor.

    Returns
    -------
    float
        0 for a position in coarse steps, which change one by one, and with too few samples.
    """
    moved = np.abs(np.diff(position))
    if len(position) <= STRIDE or not within.any() or np.ptp(position) == 0:
        return 0.0
    # motion over several steps, so that rests do not count
    way = np.abs(position[STRIDE:] - position[:-STRIDE])
    moves = np.zeros(len(moved), dtype=bool)
    fast = np.flatnonzero(way > 0.25 * np.quantile(way, 0.9))
    moves[fast + STRIDE // 2] = True
    moves &= within
    jumps = moved[moves & (moved > 0)]
    if len(jumps) < 20:
        return 0.0
    if np.isfinite(step) and np.median(jumps) < CATCHES * step:
        return 0.0
    if np.isnan(step) and len(np.unique(position)) < RECURS * len(jumps):
        return 0.0  # few values that recur, of which no step can be told
    return float(np.mean(moved[moves] == 0))


def is_held(torque: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Rows in which all torques equal those of the previous row, as a mask.

    Parameters
    ----------
    torque : ndarray of shape (n_samples, n_joints)
        Recorded torque.
    moved : ndarray of shape (n_samples - 1,) of bool
        Rows after the first to which positions moved.

    Returns
    -------
    ndarray of shape (n_samples,) of bool
        Empty where it is the coarse steps of a sensor: these change one by one.
    """
    same = torque[1:] == torque[:-1]
    changing = np.ptp(torque, axis=0) > 0
    again = np.zeros(len(torque), dtype=bool)
    if changing.sum() < 2 or not moved.any():
        return again
    same = same[:, changing]
    together = np.all(same, axis=1) & moved
    share, single = together.sum() / moved.sum(), same[moved].mean(axis=0)
    # Joints that hold independently sometimes do so at the same time.
    by_chance = float(np.prod(single))
    at_once = share - by_chance > 0.5 * (float(single.min()) - by_chance)
    if share > HELD and share > AT_ONCE * single.max() and at_once:
        again[1:] = together
    return again


def equal_values(values: np.ndarray, trajectory: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First rows of the parts of recordings with one value of a channel, and those after them.

    Parameters
    ----------
    values, trajectory : ndarray of shape (n_samples,)
        Channel, and recording of every row.
    """
    new = (values[1:] != values[:-1]) | (trajectory[1:] != trajectory[:-1])
    begins = np.flatnonzero(np.r_[True, new])
    return begins, np.append(begins[1:], len(values))


def idle_rows(
    position: np.ndarray,
    velocity: np.ndarray,
    torque: np.ndarray,
    time: np.ndarray,
    trajectory: np.ndarray,
) -> np.ndarray:
    """Rows at the ends of recordings in which torque was not measured, as a mask.

    Before drives are enabled every torque is zero; a logger that receives torques late repeats the
    first ones, and one that loses its source the last ones of all channels.

    Parameters
    ----------
    position, velocity, torque : ndarray of shape (n_samples, n_joints)
        Recorded signals.
    time : ndarray of shape (n_samples,), s
        Recorded clock.
    trajectory : ndarray of shape (n_samples,)
        Recording of every row.

    Returns
    -------
    ndarray of shape (n_samples,) of bool
        Rows of zeros, or rows of the same torques in which a joint moves, by its positions or by
        its velocity.
    """
    idle = np.zeros(len(torque), dtype=bool)
    if torque.shape[1] < 2 or np.mean(torque == 0) > MOSTLY_ZERO:
        return idle  # of one joint, or coarse: zeros come by themselves
    steps = np.diff(time)[trajectory[1:] == trajectory[:-1]]
    least = max(IDLE_ROWS, IDLE_TIME / max(float(np.median(steps)), 1e-9)) if len(steps) else np.inf
    # A coarse torque repeats itself everywhere; at the ends it must do so for longer.
    new = np.any(torque[1:] != torque[:-1], axis=1) | (trajectory[1:] != trajectory[:-1])
    lengths = np.diff(np.flatnonzero(new), prepend=-1)
    least = max(least, 3 * float(np.quantile(lengths, 0.99))) if len(lengths) else least
    far = IDLE_WAY * np.ptp(position, axis=0)
    for run in np.unique(trajectory):
        rows = np.flatnonzero(trajectory == run)
        for end in (rows, rows[::-1]):
            changes = np.any(torque[end] != torque[end[0]], axis=1)
            same = end[: int(np.argmax(changes))]  # none where it is constant throughout
            if len(same) < least:
                continue
            duration = abs(float(time[same[-1]] - time[same[0]]))
            way = np.abs(np.mean(velocity[same], axis=0)) * duration
            moved = np.any(np.maximum(np.ptp(position[same], axis=0), way) > far)
            if moved or not torque[same].any():
                idle[same] = True
    return idle


def lost_parts(position: np.ndarray, torque: np.ndarray, trajectory: np.ndarray) -> np.ndarray:
    """Rows in parts of recordings in which all torques keep their last values, as a mask.

    Parameters
    ----------
    position, torque : ndarray of shape (n_samples, n_joints)
        Recorded signals.
    trajectory : ndarray of shape (n_samples,)
        Recording of every row.

    Returns
    -------
    ndarray of shape (n_samples,) of bool
        Rows after the first of every such part in which a joint moves; none for a torque that
        keeps its values everywhere, or hardly ever.
    """
    lost = np.zeros(len(torque), dtype=bool)
    changing = np.ptp(torque, axis=0) > 0
    if changing.sum() < 2:
        return lost
    torque = torque[:, changing]
    new = np.any(torque[1:] != torque[:-1], axis=1) | (trajectory[1:] != trajectory[:-1])
    begins = np.flatnonzero(np.r_[True, new])
    ends = np.append(begins[1:], len(torque))
    lengths = ends - begins
    least = max(IDLE_ROWS, LOST * float(np.quantile(lengths, 0.95)))
    far = IDLE_WAY * np.ptp(position, axis=0)
    # all are lost and come again at once, unlike values that each torque keeps by itself
    changed = np.mean(torque[1:] != torque[:-1], axis=1) > MOST_CHANGE
    parts = [
        slice(a + 1, b)
        for a, b in zip(begins, ends, strict=True)
        if b - a >= least
        and torque[a].any()
        and np.any(np.ptp(position[a:b], axis=0) > far)
        and 0 < a
        and b < len(torque)
        and changed[a - 1]
        and changed[b - 1]
        and trajectory[a - 1] == trajectory[a] == trajectory[b]
    ]
    if len(parts) >= FEWEST_LOST:
        for part in parts:
            lost[part] = True
    return lost


def missing_values(torque: np.ndarray, idle: np.ndarray) -> np.ndarray:
    """Zeros beside which the torque is not small, as a mask of shape (n_samples, n_joints).

    Parameters
    ----------
    torque : ndarray of shape (n_samples, n_joints), N m or N
        Recorded torque.
    idle : ndarray of shape (n_samples,) of bool
        Rows that do not count.
    """
    missing, signs = np.zeros(torque.shape, dtype=bool), np.sign(torque)
    for k, values in enumerate(np.abs(torque.T)):
        zero = (values == 0) & ~idle
        begins, ends = runs_of(zero)
        inside = (begins > 0) & (ends < len(values))
        begins, ends = begins[inside], ends[inside]
        if not len(begins) or zero.mean() > MOSTLY_ZERO:
            continue
        least = float(values[values > 0].min())
        nearest = max(np.sum(torque[~idle, k] == value) for value in (-least, least))
        if zero.sum() < MORE_ZEROS * nearest:
            continue  # zero is one of the steps of a coarse torque
        beside = np.minimum(values[begins - 1], values[ends])
        # dry friction passes a dead band from one sign to the other
        beside[signs[begins - 1, k] != signs[ends, k]] = 0.0
        usual = JUMPS * float(np.median(values[~zero]))
        # a coarse torque is one step away from zero
        jump = beside > (max(usual, 1.5 * least) if len(np.unique(values)) < FINE else usual)
        for a, b in zip(begins[jump], ends[jump], strict=True):
            missing[a:b, k] = True
        if jump.sum() < FEWEST_MISSING or missing[:, k].sum() < 0.5 * zero.sum():
            missing[:, k] = False  # zeros are usual
    return missing


def rest_share(velocity: np.ndarray) -> float:
    """Share of rows in which a joint is at rest: below 0.5 % of its largest velocity."""
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
    """Share of rows in runs of five or more at the extreme value of the torque.

    A torque that keeps other values for as long, as after a median filter, or while values are
    lost, keeps its extreme ones without any limit: these recur, or last longer, at a limit.
    """
    span = np.ptp(torque)
    if span == 0:
        return 1.0
    high = torque >= torque.max() - 1e-6 * span
    low = torque <= torque.min() + 1e-6 * span
    # the smallest magnitude is not a limit
    limits = [_plateaus(side & (torque != 0), segments) for side in (high, low)]
    if not any(map(len, limits)):
        return 0.0
    same = np.zeros(len(torque), dtype=bool)
    same[1:] = torque[1:] == torque[:-1]
    others = 1 + _plateaus(same & ~(high | low), segments, PLATEAU - 1)
    longest = int(others.max(initial=0))
    rows = sum(x.sum() for x in limits if len(x) > 1 or x.max(initial=0) > longest)
    return float(rows) / len(torque)


def _plateaus(values: np.ndarray, segments: Sequence[slice], least: int = PLATEAU) -> np.ndarray:
    """Lengths of the runs of true values, of at least some length, within segments."""
    lengths = [np.zeros(0, dtype=int)]
    for part in segments:
        begins, ends = runs_of(values[part])
        lengths.append(ends - begins)
    found = np.concatenate(lengths)
    return np.asarray(found[found >= least])


def excited(position: np.ndarray, velocity: np.ndarray, segments: Sequence[slice]) -> bool:
    """Whether a joint moves at all: more than 100 steps of noise, in both directions."""
    span = np.ptp(position)
    noise = np.median(np.abs(np.diff(position, n=2))) if len(position) > 2 else 0.0
    if span <= 1e-3 or span <= 20 * noise:
        return False
    # a velocity without its sign has no reversals
    turns = reversals(velocity, segments)
    if not turns:
        parts = [np.diff(position[rows][::STRIDE]) for rows in segments]
        ends = np.cumsum([0, *map(len, parts)])
        pieces = [slice(a, b) for a, b in zip(ends[:-1], ends[1:], strict=True)]
        ways = np.concatenate(parts)
        turns = reversals(ways, pieces) if len(ways) else 0
    return turns > 0


def divided_differences(values: np.ndarray, time: np.ndarray, order: int) -> np.ndarray:
    """Differences that are zero for polynomials below their order, also with uneven steps.

    They are scaled so that white noise keeps its size.

    Parameters
    ----------
    values : ndarray of shape (n_samples, ...)
        Samples of one trajectory.
    time : ndarray of shape (n_samples,), s
        Their times.
    order : int
        Order of the differences.

    Returns
    -------
    ndarray of shape (n_samples - order, ...)
    """
    n = len(values) - order
    near = np.stack([time[k : n + k] for k in range(order + 1)])
    apart = near[:, None] - near[None, :]
    apart /= np.abs(apart).max(axis=(0, 1)) + 1e-300  # products of small steps would be tiny
    apart[np.arange(order + 1), np.arange(order + 1)] = 1.0
    weights = 1 / np.where(apart == 0, np.finfo(float).eps, apart).prod(axis=1)
    weights /= np.sqrt(np.sum(weights**2, axis=0))
    shape = (n, *(1,) * (values.ndim - 1))
    return np.asarray(sum(w.reshape(shape) * values[k : n + k] for k, w in enumerate(weights)))


def is_short(values: np.ndarray) -> bool:
    """Whether all values are numbers of half precision, eleven binary digits.

    Parameters
    ----------
    values : ndarray of shape (n_samples,)
    """
    if np.abs(values).max() > 6e4 or np.any(values != values.astype(np.float16)):
        return False
    return len(np.unique(values)) >= 50
