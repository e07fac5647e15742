# SPDX-License-Identifier: BSD-3-Clause
"""Cut-off of the smoother of positions: below the usual one if their noise is strong.

Noise of positions grows with the square of the frequency in accelerations. Where it is not small
there, the cut-off is lowered until it is, but not below the frequencies at which the positions show
motion: these are found by predicting every position from its neighbours (leave-one-out error of a
linear smoother, Allen 1974, Technometrics 16(1)).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from skidyn._local_polynomial import local_polynomial, middle_weights
from skidyn._signals import Array

#: Order of the local polynomial. Of accelerations of 6 Hz sampled at 100 Hz, a quartic of the same
#: noise loses 0.7 %, which looks like an elastic joint if the torque is precise; this order loses
#: 0.1 %.
ORDER = 6
#: Highest cut-off in Hz, and the largest share of the sampling rate.
HIGHEST_CUTOFF, CUTOFF_SHARE = 27.0, 0.24
#: Largest half width of a window in samples.
WIDEST = 250
#: Noise of accelerations, relative to these themselves, that is small.
SMALL = 0.1
#: Ratio of neighbouring cut-offs that are compared, and the lowest of them, Hz.
RATIO, LOWEST = 1.2, 4.0
#: How far above the cut-off that predicts positions best the chosen one is: the smoother loses a
#: few percent of an acceleration just below its cut-off, which do not matter to a position.
ABOVE = 1.5
#: Share of the samples of a recording that the half width of the smoother may have: some 16 windows
#: of rows, which are as wide as the cut-off demands, fit side by side.
LONGEST = 1 / 30
#: Samples of all recordings from which a cut-off is chosen.
MOST_SAMPLES = 20_000
#: Median of the size of a normal variable of unit variance.
MEDIAN = 0.6745


def usual_cutoff(rate: float) -> float:
    """Cut-off in Hz for positions without much noise."""
    return min(HIGHEST_CUTOFF, CUTOFF_SHARE * rate)


def half_width(rate: float, cutoff: float) -> int:
    """Half width of a Savitzky-Golay filter in samples (Schafer 2011, IEEE SPM 28)."""
    half = ((ORDER + 1) / (2 * cutoff / rate) + 4.6) / 3.2
    return int(np.clip(round(half), 4, WIDEST))


def lowered_cutoff(parts: Sequence[Array], rate: float, units: Array) -> float:
    """Cut-off at which the noise of positions is small in accelerations, if there is one.

    Parameters
    ----------
    parts : sequence of ndarray of shape (n_samples_k, n_joints), rad or m
        Positions at even steps.
    rate : float, Hz
        Of these steps.
    units : ndarray of shape (n_joints,), rad or m
        Moderate motion of each joint, by which joints are compared.

    Returns
    -------
    float, Hz
        The usual one, or a lower one.
    """
    cutoff = usual_cutoff(rate)
    half = half_width(rate, cutoff)
    most = max(8 * half, MOST_SAMPLES // max(1, len(parts)))
    parts = [_middle(q, most) for q in parts if len(q) > 2 * half]
    share = _noise_share([q / units for q in parts], rate, half) if parts else 0.0
    if share <= SMALL:
        return cutoff
    # the noise of an acceleration grows with the power 2.5 of the cut-off
    quiet = cutoff * (SMALL / share) ** 0.4
    # a coarse position that is sampled often is equal to its neighbours
    every = max(1, int(rate * CUTOFF_SHARE / cutoff))
    few, slow = [q[::every] for q in parts], rate / every
    steps = np.arange(1 + int(np.log(cutoff / LOWEST) / np.log(RATIO)))
    longest = LONGEST * min(map(len, few))
    tried = [f for f in (cutoff / RATIO**steps).tolist() if half_width(slow, f) <= longest]
    if not tried:
        return cutoff
    halves = [half_width(slow, f) for f in tried]
    errors = [_left_out_error(few, h, max(halves)) for h in halves]
    return float(min(cutoff, max(quiet, ABOVE * tried[int(np.argmin(errors))], tried[-1])))


def _middle(q: Array, most: int) -> Array:
    """So many samples in the middle of a recording."""
    start = max(0, (len(q) - most) // 2)
    return q[start : start + most]


def _noise_share(parts: Sequence[Array], rate: float, half: int) -> float:
    """Noise of smoothed accelerations relative to these themselves, over all joints."""
    value, _, bend = middle_weights(2 * half + 1, ORDER)
    left, bends = [], []
    for q in parts:
        smooth, _, ddq = local_polynomial(q, 2 * half + 1, ORDER, 1 / rate)
        left.append((q - smooth)[half:-half])
        bends.append(ddq[half:-half])
    # what a least-squares polynomial leaves of white noise
    removed = np.median(np.abs(np.concatenate(left)), axis=0) / MEDIAN
    noise = removed**2 / (1 - value[half]) * np.sum(bend**2) * rate**4
    size = np.mean(np.concatenate(bends) ** 2, axis=0)
    return float(np.sqrt(noise.sum() / size.sum())) if size.any() else 0.0


def _left_out_error(parts: Sequence[Array], half: int, edge: int) -> float:
    """Mean logarithm over joints of the squared error of positions predicted by their neighbours.

    The polynomial through the other samples of a window misses its middle by the residual of the
    polynomial through all of them, divided by 1 minus the weight of the middle.
    """
    weights = middle_weights(2 * half + 1, ORDER)[0]
    square, count = 0.0, 0
    for q in parts:
        own = q[edge - half : len(q) - edge + half]
        smooth = np.stack([np.correlate(x, weights, "valid") for x in own.T], axis=1)
        square = square + np.sum((own[half : len(own) - half] - smooth) ** 2, axis=0)
        count += len(smooth)
    error = np.asarray(square) / count / (1 - weights[half]) ** 2
    return float(np.mean(np.log(error[error > 0]))) if (error > 0).any() else 0.0
