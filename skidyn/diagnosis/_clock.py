# SPDX-License-Identifier: BSD-3-Clause
"""A torque periodic in time: the strongest line of the residual's spectrum over the clock."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from skidyn._signals import Array, Signals

#: Lowest and highest frequency in Hz, points of the spectrum, height over the local median.
LOWEST, HIGHEST, POINTS, HEIGHT = 0.3, 25.0, 4096, 4.0
#: Samples used for the coherent refinement.
COHERENT = 2500


def clock_line(
    signals: Signals, residual: Array, use: NDArray[np.bool_], rate: float
) -> float | None:
    """Frequency of the strongest line that stands out, None where none does.

    Spectra of the segments are added up, so that their phases do not matter; the frequency is
    then refined over the whole log, where the phase must hold.

    Parameters
    ----------
    signals : Signals
        Motion.
    residual : ndarray of shape (n_samples,), N m or N
        Residual of one joint.
    use : ndarray of shape (n_samples,) of bool
        Samples that enter.
    rate : float
        Sampling rate in Hz.

    Returns
    -------
    float or None
        Hz.
    """
    clean = np.where(use, residual, 0.0)
    power: Array = np.zeros(POINTS // 2 + 1)
    spans = []
    for rows in signals.segments:
        time = signals.clock[rows]
        grid = np.arange(time[0], time[-1], 1 / rate)
        if len(grid) < 32:
            continue
        y = np.interp(grid, time, clean[rows])[:POINTS]
        one = np.abs(np.fft.rfft((y - y.mean()) * np.hanning(len(y)), POINTS)) ** 2
        power += one / max(one.mean(), np.finfo(float).tiny)
        spans.append(float(np.ptp(time)))
    frequency = np.fft.rfftfreq(POINTS, 1 / rate)
    band = (frequency > LOWEST) & (frequency < min(HIGHEST, rate / 2.2))
    if not spans or band.sum() < 10:
        return None
    inside = power[band]
    ratio = inside / np.maximum(median_filter(inside, min(201, len(inside))), 1e-9)
    best = int(np.argmax(ratio))
    if ratio[best] < HEIGHT:
        return None
    centre = float(frequency[band][best])
    reach = 0.4 / float(np.mean(spans))
    fine = np.arange(centre - reach, centre + reach, 0.2 / float(np.ptp(signals.clock)))
    thin = max(1, len(clean) // COHERENT)
    time, values = signals.clock[::thin], clean[::thin]
    strength = [np.abs(np.exp(-2j * np.pi * f * time) @ values) for f in fine]
    return float(fine[int(np.argmax(strength))])
