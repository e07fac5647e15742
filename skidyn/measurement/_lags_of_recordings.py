# SPDX-License-Identifier: BSD-3-Clause
"""Torque that has another lag in every recording, as that of a second logger started by hand.

Bodies are common to all recordings, and the lag of each is the one at which they explain its torque
best; bodies and lags are found in turn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._fits import SAMPLES
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._peak import vertex
from skidyn.measurement._robust import FREEDOM, RobustFit, fit_together, gains_of
from skidyn.measurement._score import Score
from skidyn.measurement._torque import readable_fits

#: Lags that are tried, s, and rounds.
LAGS = np.linspace(-0.5, 0.5, 51)
ROUNDS = 10
#: Fewest recordings, and rows of one, to have a lag of its own.
RECORDINGS, FEWEST = 3, 12
#: Log-likelihood that lags of recordings must gain over a common one, and for each of them; share
#: of it that a single joint may gain; and share of the residual that they may leave of some joint.
SURE, EACH, ALONE, LEFT = 40.0, 5.0, 0.9, 0.7
#: Least spread of the lags, s.
APART = 0.02


@dataclass(frozen=True)
class LagsOfRecordings:
    """Lags of the torque in recordings.

    Attributes
    ----------
    lags : dict of int to float, s
        By recording; positive if its torque is late.
    gain : float
        Log-likelihood that their removal gains over that of a common lag.
    left : float
        Share of the residual that it leaves of the joint that it helps most.
    """

    lags: dict[int, float]
    gain: float
    left: float


def lags_of_recordings(measurement: Measurement) -> LagsOfRecordings | None:
    """Lags of the recordings of a measurement; None if they have a common one, or none."""
    fits = readable_fits(measurement)
    if fits is None or measurement.stale:
        return None
    return measurement.once("lags_of_recordings", lambda: find_lags(Score(fits.loaded())))


def find_lags(score: Score) -> LagsOfRecordings | None:
    """Lags of recordings that explain all torques better than a common one; None if none do.

    Parameters
    ----------
    score : Score
        Fit of all joints.
    """
    fits, together = score.fits, score.together
    number = fits.recording
    runs, counts = np.unique(number, return_counts=True)
    if len(runs) < RECORDINGS or counts.min() < FEWEST or not score.joints:
        return None
    place, middle = np.searchsorted(runs, number), len(LAGS) // 2
    some = LAGS[middle % 2 :: 2]
    shifted = np.array([fits.average(fits.torque_at(lag)) for lag in some])
    at = np.full(len(runs), middle // 2)
    if np.ptp(_costs(score, shifted, score.plain, place, at).argmin(axis=1)) == 0:
        return None  # as in most logs
    shifted = np.array([fits.average(fits.torque_at(lag)) for lag in LAGS])
    plain = _of_common(score, shifted)
    chosen = np.full(len(runs), plain[0])
    seen: set[tuple[int, ...]] = set()
    while tuple(chosen.tolist()) not in seen and len(seen) < ROUNDS:
        seen.add(tuple(chosen.tolist()))
        fitted = _fitted(score, shifted, chosen[place])
        costs = _costs(score, shifted, fitted, place, chosen)
        chosen = costs.argmin(axis=1)
    if np.any((chosen == 0) | (chosen == len(LAGS) - 1)):
        return None
    between = [
        vertex(*(-cost[at - 1 : at + 2]).tolist()) or 0.0
        for at, cost in zip(chosen, costs, strict=True)
    ]
    lags = LAGS[chosen] + np.array(between) * (LAGS[1] - LAGS[0])
    if np.ptp(lags) < APART:
        return None
    there = together.fit_at(np.repeat(lags[place], SAMPLES))
    gains = np.array(gains_of(plain[1], there))
    gain = float(gains.sum())
    left = [after.scale / before.scale for before, after in zip(plain[1], there, strict=True)]
    several = len(gains) < 2 or gains.max() < ALONE * gain
    if gain < SURE + EACH * len(runs) or not several or min(left) > LEFT:
        return None
    return LagsOfRecordings(
        dict(zip(runs.tolist(), lags.tolist(), strict=True)), gain, float(min(left))
    )


def _of_common(score: Score, shifted: Array) -> tuple[int, list[RobustFit]]:
    """The best common lag: its place among those tried, and its fit."""
    rows = np.zeros(shifted.shape[1], dtype=np.int64)
    at, best, found = len(LAGS) // 2, -np.inf, score.plain
    for step in (8, 2, 1):  # from coarse to fine
        near = {at + k * step for k in range(-3, 4)} & set(range(len(LAGS)))
        for tried in sorted(near):
            fitted = _fitted(score, shifted, rows + tried)
            likelihood = sum(fit.likelihood for fit in fitted)
            if likelihood > best:
                at, best, found = tried, likelihood, fitted
    return at, found


def _fitted(score: Score, shifted: Array, at: np.ndarray) -> list[RobustFit]:
    """Fits of all joints to the torque at one of the lags, row by row."""
    together = score.together
    torque = shifted[at, np.arange(len(at))]
    targets = [torque[use, j] for j, use in zip(together.joints, together.rows, strict=True)]
    return fit_together(together.designs, together.places, targets)


def _costs(
    score: Score,
    shifted: Array,
    fitted: list[RobustFit],
    place: np.ndarray,
    chosen: np.ndarray,
) -> Array:
    """Unlikelihood of every recording at every lag, with the bodies of these fits."""
    together = score.together
    costs = np.zeros((len(chosen), len(shifted)))
    rows = np.arange(len(place))
    for j, use, fit in zip(together.joints, together.rows, fitted, strict=True):
        predicted = shifted[chosen[place], rows, j][use] - fit.residual
        left = shifted[:, use, j] - predicted
        square = np.log1p((left / fit.scale) ** 2 / FREEDOM)
        for run in range(len(chosen)):
            costs[run] += square[:, place[use] == run].sum(axis=1)
    return costs
