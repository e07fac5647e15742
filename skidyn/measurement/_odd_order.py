# SPDX-License-Identifier: BSD-3-Clause
"""Torques that are exchanged in a single recording."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._bodies import Explained
from skidyn.measurement._robust import student

#: Fewest rows of a recording in which both joints move.
FEWEST = 12
#: Log-likelihood that an exchange must gain, and the most that it may leave on either joint, as a
#: share of what is left without it and of the spread of its torque.
SURE, LEFT, SPREAD = 40.0, 0.3, 0.5
#: Error of identified bodies, as a share of the spread, from which recordings are compared.
WORTH = 0.08


@dataclass(frozen=True)
class Exchange:
    """Two torques that are exchanged in a recording: joints from 0, and log-likelihood gain."""

    run: int
    joints: tuple[int, int]
    gain: float


def find_exchanges(seen: Explained) -> Iterator[Exchange]:
    """Recordings in which two torques are those that the others predict for each other.

    Parameters
    ----------
    seen : Explained
        Fits of all recordings.
    """
    fits, outcome = seen.fits, seen.identified
    if len(seen.joints) < 2 or not np.any(seen.errors[1] > WORTH):
        return
    number = fits.recording
    runs = np.unique(number)
    if len(runs) < 3:
        return
    parts = [number == run for run in runs]
    for run, rows, others in zip(runs, parts, fits.predicted_without(parts), strict=True):
        # a row of every joint, for pairs of them
        predicted = np.full((fits.n_rows, fits.n_joints), np.nan)
        for k, (values, _) in others.items():
            predicted[rows & fits.moving[:, k], k] = values
        found = []
        for pair in combinations(sorted(others), 2):
            both = rows & fits.moving[:, pair[0]] & fits.moving[:, pair[1]]
            if both.sum() < FEWEST:
                continue
            p = predicted[both][:, list(pair)]
            y = np.stack([fits.mean_torque(k)[0][both] for k in pair], axis=1)
            scales = np.array([others[k][1] for k in pair])
            inflation = np.array([outcome.inflation_of(k) for k in pair])
            gain = _gain(y[:, ::-1] - p, y - p, scales, inflation)
            plain, exchanged = (np.sqrt(np.mean((x - p) ** 2, axis=0)) for x in (y, y[:, ::-1]))
            alike = exchanged < np.minimum(LEFT * plain, SPREAD * np.std(y[:, ::-1], axis=0))
            if gain > SURE and alike.all():
                found.append(Exchange(int(run), pair, gain))
        if found:
            yield max(found, key=lambda one: one.gain)


def _gain(there: Array, here: Array, scales: Array, inflation: Array) -> float:
    """Log-likelihood gain of some residuals over others, of two joints."""
    return float(
        sum(
            (student(a, s) - student(b, s)) / i
            for a, b, s, i in zip(there.T, here.T, scales, inflation, strict=True)
        )
    )
