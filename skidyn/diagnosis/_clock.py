# SPDX-License-Identifier: BSD-3-Clause
"""A torque periodic in time: the strongest line of the residual's spectrum over time.

A wave that is faster than the motion is a line in the sum of the spectra of the segments, whatever
its phase is in each of them. A slower one, which may be multiplied by a signal, is found with a
common phase in all segments, by the time of the log or since the start of each recording.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.optimize import minimize_scalar
from scipy.stats import gamma

from skidyn._signals import Array, Signals

#: Lowest frequency in Hz; share of the sampling rate that is the highest.
LOWEST, HIGHEST = 0.3, 0.45
#: Number of frequencies around a line whose median is its noise, least rows of a segment, and least
#: number of frequencies.
NEIGHBOURS, SHORTEST, FEWEST = 201, 32, 10
#: Chance of a line, over all frequencies, below which it is tested.
WORTH = 0.01
#: Rows per second in which a slow wave is searched, frequencies of the spectrum per resolved one,
#: and width, Hz, of the band around a line whose median is its noise.
SLOW_RATE, FINER, AROUND = 40.0, 4, 2.0
#: Number of periods within the longest recording from which a wave is no drift.
PERIODS = 1.5
#: Longest time, s, over which a slow wave has a common phase.
LONGEST = 6000.0
#: Share of a wave from which motion contains it.
CONTAINED = 0.5
#: Samples used for the coherent refinement, which thins the log no further than the line allows.
COHERENT = 4000


@dataclass(frozen=True)
class ClockLine:
    """The strongest line of a residual over time.

    Attributes
    ----------
    frequency : float, Hz
    chance : float
        Probability of a line of this height at any frequency of the band in noise.
    height : float
        Power over that of the noise near it, summed over the segments.
    """

    frequency: float
    chance: float
    height: float


def clock_line(
    signals: Signals,
    residual: Array,
    use: NDArray[np.bool_],
    rate: float,
    band: tuple[float, float] = (LOWEST, np.inf),
) -> ClockLine | None:
    """The strongest significant line, or None.

    Spectra of the segments are added, so that their phases do not matter; relative to its local
    median the sum of m spectra of noise follows a gamma distribution of shape m. The frequency is
    then refined over the whole log with a common phase.

    Parameters
    ----------
    signals : Signals
        Motion.
    residual : ndarray of shape (n_samples,), N m or N
        Residual of one joint.
    use : ndarray of shape (n_samples,) of bool
        Samples that are used.
    rate : float, Hz
        Sampling rate.
    band : (float, float), Hz
        Lowest and highest frequency.
    """
    clean = np.where(use, residual, 0.0)
    segments = [rows for rows in signals.segments if _length(signals, rows, rate) >= SHORTEST]
    if not segments:
        return None
    points = 2 ** int(np.ceil(np.log2(2 * max(_length(signals, r, rate) for r in segments))))
    power: Array = np.zeros(points // 2 + 1)
    for rows in segments:
        time = signals.clock[rows]
        y = np.interp(np.arange(time[0], time[-1], 1 / rate), time, clean[rows])
        one = np.abs(np.fft.rfft((y - y.mean()) * np.hanning(len(y)), points)) ** 2
        power += one / max(one.mean(), np.finfo(float).tiny)
    frequency = np.fft.rfftfreq(points, 1 / rate)
    inside = (frequency > band[0]) & (frequency < min(band[1], HIGHEST * rate))
    if inside.sum() < FEWEST:
        return None
    here, m = power[inside], len(segments)
    level = median_filter(here, min(NEIGHBOURS * points // 4096 | 1, len(here)))
    ratio = here / np.maximum(level, 1e-9) * gamma.median(m)
    best = int(np.argmax(ratio))
    chance = min(1.0, float(gamma.sf(ratio[best], m)) * int(inside.sum()))
    if chance > WORTH:
        return None
    spans = [float(np.ptp(signals.clock[rows])) for rows in segments]
    refined = _refined(signals, clean, float(frequency[inside][best]), max(spans))
    return ClockLine(refined, chance, float(ratio[best]) - m)


def _length(signals: Signals, rows: slice, rate: float) -> int:
    return int(np.ptp(signals.clock[rows]) * rate) if rows.stop > rows.start else 0


def _refined(signals: Signals, clean: Array, centre: float, span: float) -> float:
    """Frequency near a line with the most coherent phase over the whole log."""
    time = signals.clock
    whole = max(float(np.ptp(time)), span)
    reach, step = 0.6 / span, 0.2 / whole
    thin = max(1, len(time) // COHERENT)
    # Samples are averaged after the line has been shifted to zero, so none of it is lost.
    still = clean * np.exp(-2j * np.pi * centre * time)
    starts = np.arange(0, len(time), thin)
    slow = np.add.reduceat(still, starts)
    middle = np.add.reduceat(time, starts) / np.diff(np.append(starts, len(time)))
    # Each frequency is the previous one rotated by the same angle at every sample.
    slow = slow * np.exp(2j * np.pi * reach * middle)
    turn = np.exp(-2j * np.pi * step * middle)
    count = int(2 * reach / step) + 1
    strength = np.empty(count)
    for k in range(count):
        strength[k] = np.abs(slow.sum())
        slow *= turn
    return centre - reach + step * int(np.argmax(strength))


def slow_lines(
    signals: Signals,
    residual: Array,
    carriers: Sequence[Array],
    use: NDArray[np.bool_],
    band: tuple[float, float],
) -> list[dict[str, float]]:
    """Shapes of the strongest waves that, multiplied by some signals, explain a residual.

    Parameters
    ----------
    signals : Signals
        Motion.
    residual : ndarray of shape (n_samples,), N m or N
        Residual of one joint.
    carriers : sequence of ndarray of shape (n_samples,)
        Signals by which the wave is multiplied; each has an amplitude and a phase of its own.
    use : ndarray of shape (n_samples,) of bool
        Samples that are used.
    band : (float, float), Hz
        Lowest and highest frequency. A wave by the time of the log may be slower if one and a half
        of its periods fit into a recording.

    Returns
    -------
    list of dict
        ``frequency``, Hz, and ``since_start`` if the phase begins anew with every recording; empty
        if no wave stands out of its neighbours. A wave that the motion contains, as if every
        recording repeats one periodic motion, is left out: a function of the motion is not
        separable from it.
    """
    found = []
    band = (band[0], min(band[1], HIGHEST * signals.rate))
    lower = min(band[0], PERIODS / max(float(signals.since_start.max()), 1e-9))
    for time, lowest, shape in (
        (signals.clock, lower, {}),
        (signals.since_start, band[0], {"since_start": 1.0}),
    ):
        frequency = _slow_line(time, residual, carriers, use, (lowest, band[1]))
        if frequency is not None and not _in_motion(signals, time, frequency):
            found.append({"frequency": frequency, **shape})
    return found


def _in_motion(signals: Signals, time: Array, frequency: float) -> bool:
    """Whether positions, velocities and accelerations of all joints contain a wave in time."""
    some = slice(None, None, max(1, len(time) // COHERENT))
    motion = [signals.q, signals.dq, signals.ddq, np.ones((len(time), 1))]
    block = np.hstack([part[some] for part in motion])
    wave = np.exp(2j * np.pi * frequency * time[some])
    wave = np.column_stack([wave.real, wave.imag])
    left = wave - block @ np.linalg.lstsq(block, wave, rcond=1e-9)[0]
    return bool(np.sum(left**2) < (1 - CONTAINED) * np.sum(wave**2))


def _slow_line(
    time: Array,
    residual: Array,
    carriers: Sequence[Array],
    use: NDArray[np.bool_],
    band: tuple[float, float],
) -> float | None:
    """Frequency of the strongest wave with a common phase, Hz; None if it does not stand out."""
    if use.sum() < SHORTEST or np.ptp(time[use]) > LONGEST:
        return None
    own = np.column_stack([carrier[use] for carrier in carriers])
    own = own / np.maximum(np.sqrt(np.mean(own**2, axis=0)), np.finfo(float).tiny)
    place = ((time[use] - time[use].min()) * SLOW_RATE).astype(np.int64)
    count, n = int(place.max()) + 1, len(carriers)
    points = 2 ** int(np.ceil(np.log2(FINER * count)))
    frequency = np.fft.rfftfreq(points, 1 / SLOW_RATE)
    inside = (frequency > band[0]) & (frequency < band[1])
    if inside.sum() < FEWEST:
        return None
    weighted = own * residual[use][:, None]
    waves = np.array([np.fft.rfft(np.bincount(place, w, count), points) for w in weighted.T])
    inverse = np.linalg.pinv(own.T @ own)
    power = np.real(np.einsum("kf,kl,lf->f", waves.conj(), inverse, waves))[inside]
    width = max(3, int(AROUND / frequency[1]))
    sparse = max(1, width // NEIGHBOURS)
    some = slice(None, None, sparse)
    nearby = median_filter(power[some], max(3, width // sparse | 1))
    level = np.interp(frequency[inside], frequency[inside][some], nearby)
    ratio = power / np.maximum(level, np.finfo(float).tiny) * gamma.median(n)
    best = int(np.argmax(power))
    chance = float(gamma.sf(ratio[best], n)) * int(inside.sum()) / FINER
    if chance > WORTH or not 0 < best < len(power) - 1:
        return None
    held = np.flatnonzero(np.bincount(place))
    values = np.column_stack([time[use], residual[use], own])
    means = [np.bincount(place, v)[held] / np.bincount(place)[held] for v in values.T]
    reach = FINER * float(frequency[1])
    return _exact(float(frequency[inside][best]), reach, *means)


def _exact(middle: float, reach: float, time: Array, residual: Array, *carriers: Array) -> float:
    """Frequency near a line at which the wave leaves least beside the signals themselves.

    Motion is not orthogonal to a wave of few periods, so that its line is shifted.
    """

    def left(tried: float) -> float:
        waves = np.exp(2j * np.pi * tried * time)
        parts = [c * part for c in carriers for part in (waves.real, waves.imag)]
        block = np.column_stack([*parts, *carriers, np.ones_like(time)])
        size = np.linalg.lstsq(block.T @ block, block.T @ residual, rcond=1e-12)[0]
        return float(np.sum((residual - block @ size) ** 2))

    steps = middle + np.linspace(-reach, reach, 4 * FINER + 1)
    best = int(np.argmin([left(tried) for tried in steps]))
    bounds = (steps[max(0, best - 1)], steps[min(len(steps) - 1, best + 1)])
    return float(minimize_scalar(left, bounds=bounds, method="bounded").x)
