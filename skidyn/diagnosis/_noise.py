# SPDX-License-Identifier: BSD-3-Clause
"""Noise of the torque sensor, and positions as noisy as those of a log.

The noise of the torque is the part that changes faster than any motion. Third differences of the
residual remove everything that is smooth over four samples, such as torques that depend on the
motion, and leave the sensor's noise. Their median magnitude is used, which few disturbed samples do
not affect. Noise that is correlated over several samples is not included: the value is a lower
bound, and the remainder is compared with a multiple of it. A torque that a low-pass filter made
smooth has no noise between neighbouring samples, but that which passed the filter between samples
that are further apart: the differences then grow with their distance as those of a smooth curve do,
up to the time constant of the filter, and hardly beyond it. A torque in coarse steps hardly changes
from sample to sample; its noise is at least the error of rounding to these steps.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from skidyn._sensor_steps import position_step
from skidyn._signals import Array, Signals
from skidyn.measurement import channel_step

#: Variance of the third difference of white noise of unit variance: 1 + 9 + 9 + 1.
GAIN = 20.0
#: Median of the absolute value of a normal variable.
MEDIAN = 0.6744897501960817
#: Factor by which differences grow with twice the distance of the samples where these lie within
#: the time constant of a filter, that of a smooth curve being 8; and the longest distance, s: a
#: torque that depends on the motion changes within longer ones.
SMOOTHED, LONGEST = 2.0, 0.04
#: Samples in which steps of a torque are looked for, and how many of them there are at least for
#: every value of a torque in coarse steps.
LOOKED_AT, RECUR = 20_000, 10


def as_measured(logged: Signals, smooth: Signals, q: Array, *, shifted: bool) -> Array:
    """Positions along a path with noise like that of logged ones.

    The noise is the part that a smoother removes from the logged positions, drawn at random; if an
    encoder has visible steps, positions are rounded to these instead.

    Parameters
    ----------
    logged, smooth : Signals
        Logged motion, and the same smoothed.
    q : ndarray of shape (n_samples, n_joints), rad or m
        The path.
    shifted : bool
        Whether the steps begin at a random position, as for a path that was smoothed from rounded
        positions, or at zero.

    Returns
    -------
    ndarray of shape (n_samples, n_joints), rad or m
    """
    taken = np.median(np.abs(logged.q - smooth.q), axis=0) / MEDIAN
    rng = np.random.default_rng(0)
    noise = rng.normal(size=q.shape) * taken
    for k, step in enumerate(map(position_step, logged.q.T)):
        if np.isfinite(step):
            counted = q[:, k] / step + (rng.uniform() if shifted else 0.0)
            noise[:, k] = step * (np.round(counted) - counted)
    return np.asarray(q + noise)


def sensor_noise(signals: Signals, residual: Array, torque: Array | None) -> Array:
    """Standard deviation of the torque sensor's fast noise.

    Parameters
    ----------
    signals : Signals
        Motion, with its segments.
    residual : ndarray of shape (n_samples, n_joints), N m or N
        Residual of a model.
    torque : ndarray of shape (n_samples, n_joints) or None, N m or N
        Measured torque, which may come in steps.

    Returns
    -------
    ndarray of shape (n_joints,), N m or N
        0 if a torque is constant; NaN with fewer than four samples in a row.
    """
    near = _differences(signals.segments, residual, 1)
    size, smooth, distance = near.copy(), np.isfinite(near), 1
    while smooth.any() and distance <= LONGEST * signals.rate:
        distance *= 2
        far = _differences(signals.segments, residual, distance)
        ends = smooth & (far <= SMOOTHED * near)  # not where recordings are too short
        size[ends] = near[ends]
        smooth &= ~ends
        near = far
    if torque is None:
        return size
    looked_at = torque[:: max(1, len(torque) // LOOKED_AT)]
    return np.asarray(np.maximum(size, [_rounding(channel) for channel in looked_at.T]))


def noise_of_recordings(signals: Signals, residual: Array) -> dict[int, Array]:
    """Fast noise of every recording, in units of that of the typical one, and at least 1.

    Fast motion, and what shakes an encoder, make noise in some recordings only.

    Parameters
    ----------
    signals : Signals
        Motion, with its segments.
    residual : ndarray of shape (n_samples, n_joints), N m or N
        Residual of a model.

    Returns
    -------
    dict of int to ndarray of shape (n_joints,)
        By the number of the recording.
    """
    own: dict[int, list[slice]] = {}
    for rows in signals.segments:
        own.setdefault(int(signals.trajectory[rows.start]), []).append(rows)
    names, parts = list(own), list(own.values())
    sizes = np.array([_differences(some, residual, 1) for some in parts])
    known = np.isfinite(sizes)
    typical = np.array(
        [np.median(x[k]) if k.any() else 0.0 for x, k in zip(sizes.T, known.T, strict=True)]
    )
    typical = np.where(typical > 0, typical, np.inf)
    loud = np.maximum(1.0, np.where(known, sizes, 0.0) / typical)
    return dict(zip(names, loud, strict=True))


def _differences(segments: Iterable[slice], residual: Array, distance: int) -> Array:
    """Standard deviation of white noise with the third differences of samples so far apart.

    Shape (n_joints,), N m or N; NaN without any.
    """
    parts = []
    for rows in segments:
        if rows.stop - rows.start > 3 * distance:
            apart = residual[rows]
            for _ in range(3):
                apart = apart[distance:] - apart[:-distance]
            parts.append(apart)
    if not parts:
        return np.full(residual.shape[1], np.nan)
    return np.asarray(np.median(np.abs(np.concatenate(parts)), axis=0) / MEDIAN / np.sqrt(GAIN))


def _rounding(channel: Array) -> float:
    """Standard deviation of the error of rounding to coarse steps; 0 where they are not visible."""
    if len(channel) < RECUR * len(np.unique(channel)):
        return 0.0
    step = channel_step(channel)
    return step / float(np.sqrt(12.0)) if np.isfinite(step) else 0.0
