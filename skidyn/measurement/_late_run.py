# SPDX-License-Identifier: BSD-3-Clause
"""Torque of a single recording that is late relative to that of the others.

Lags of single joints in few rows are known badly beside an effect or a load. The slope of all
torques with the lag, in the rows of one recording, is a column of the fit of all joints.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from skidyn.measurement._fits import SAMPLES
from skidyn.measurement._score import SLOPE, Score, likeliest_lag

#: Log-likelihood that a recording must promise, how many times as much as any other, and fewest
#: recordings.
LEAST, TIMES, RECORDINGS = 10.0, 3.0, 3


@dataclass(frozen=True)
class LateRun:
    """Lag of the torque in one recording.

    Attributes
    ----------
    run : int
        Recording.
    lag : float, s
        Positive if its torque is late.
    gain, common_gain : float
        Log-likelihood that its removal gains, and that of the same lag of all recordings.
    """

    run: int
    lag: float
    gain: float
    common_gain: float


def find_late_run(score: Score) -> LateRun | None:
    """The recording whose torque is explained best at another time; None if there is none.

    Parameters
    ----------
    score : Score
        Fit of all joints.
    """
    fits = score.fits
    number = fits.recording
    runs = np.unique(number)
    if len(runs) < RECORDINGS or not score.joints:
        return None
    later, earlier = (fits.average(fits.torque_at(lag)) for lag in (SLOPE, -SLOPE))
    slope = (earlier - later)[:, score.joints] / (2 * SLOPE)
    promised = {
        int(run): score.promise(np.where((number == run)[:, None], slope, 0.0)) for run in runs
    }
    run, second = sorted(promised, key=lambda run: -promised[run][0])[:2]
    if promised[run][0] < max(LEAST, TIMES * promised[second][0]):
        return None
    rows = np.repeat(number == run, SAMPLES)
    of_torque = score.gain_of_torque(range(fits.n_joints))

    def of_run(lag: float) -> float:
        return of_torque(np.where(rows, lag, 0.0))

    lag = likeliest_lag(of_run, promised[run][1])
    return LateRun(run, lag, of_run(lag), of_torque(lag))


def is_of_friction(score: Score, lags: Mapping[int, float]) -> bool:
    """Whether friction of another size in some recordings explains more than lags of their torques.

    A cold gear has more friction in the first recording, which a lag of this recording partly
    imitates, since velocity is early relative to gravity and late relative to inertia.

    Parameters
    ----------
    score : Score
        Fit of all joints.
    lags : dict of int to float, s
        Lags of the torque by recording.
    """
    fits = score.fits
    dq, lag = fits.signals.dq[:, score.joints], np.zeros(len(fits.signals.dq))
    sizes = []
    for run, of_run in lags.items():
        there = fits.recording == run
        lag[np.repeat(there, SAMPLES)] = of_run
        sizes += [fits.average(values) * there[:, None] for values in (dq, np.sign(dq))]
    with_friction = score.together.with_columns(np.stack(sizes, axis=2)).fit(fits.torque)
    return score.gain(with_friction) > score.gain_of_torque(range(fits.n_joints))(lag)
