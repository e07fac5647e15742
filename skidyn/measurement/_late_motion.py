# SPDX-License-Identifier: BSD-3-Clause
"""Motion of a single joint that is late relative to the other joints, with its torque or without.

The torques of all joints that feel this one are then explained worse, each as if it had another
lag of its own. So the slope of the residual of identified bodies with the delay of one motion, or
of all channels of a joint, is a column of the fit; the one that promises most is refined by a fit
of what is shifted.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.measurement._fits import Fits
from skidyn.measurement._joint_fit import JointFit
from skidyn.measurement._peak import peak
from skidyn.measurement._score import NEAR, SLOPE, Score, likeliest_lag

#: Log-likelihood that a slope must promise.
LEAST = 8.0


@dataclass(frozen=True)
class LateMotion:
    """Delay of position and velocity of one joint, or of its torque as well.

    Attributes
    ----------
    joint : int
        From 0.
    lag : float, s
        Positive if its motion is late.
    with_torque : bool
        Whether its torque is late by the same time.
    gain, own_gain, common_gain : float
        Log-likelihood that its removal gains, and that the removal of a delay of the torque gains,
        of the same joint and of all.
    """

    joint: int
    lag: float
    with_torque: bool
    gain: float
    own_gain: float
    common_gain: float


def find_late_motion(score: Score, common: float) -> LateMotion | None:
    """The joint whose motion explains all torques best at another time.

    None without rows, or where the slope of no joint promises a gain.

    Parameters
    ----------
    score : Score
        Fit of all joints.
    common : float, s
        Lag of all torques, about.
    """
    fits, together = score.fits, score.together
    if not score.joints:
        return None
    here = together.left(fits.torque, score.plain)
    of_torque = fits.average(fits.torque_at(SLOPE) - fits.torque) / SLOPE
    promised = {}
    for k in score.joints:
        moved = together.moved(_shifted(together.signals, k, SLOPE))
        slope = fits.average(here - moved.left(fits.torque, score.plain)) / SLOPE
        promised[k, False] = score.promise(slope)
        slope[:, score.joints.index(k)] -= of_torque[:, k]
        promised[k, True] = score.promise(slope)
    k, with_torque = max(promised, key=lambda what: promised[what][0])
    promise, first = promised[k, with_torque]
    if promise < LEAST:
        return None

    @cache  # a search comes back to where it was
    def of_motion(lag: float) -> float:
        moved = fits.with_motion(_shifted(together.signals, k, lag))
        fit = JointFit(moved, range(fits.n_joints)).fit(_torque(fits, k, lag, with_torque))
        return score.gain(fit)

    lag = likeliest_lag(of_motion, first)
    of_own, of_every = score.gain_of_torque([k]), score.gain_of_torque(range(fits.n_joints))
    own, every = of_own(peak(of_own, -lag, NEAR)), of_every(peak(of_every, common, NEAR))
    return LateMotion(k, lag, with_torque, of_motion(lag), own, every)


def _torque(fits: Fits, joint: int, lag: float, with_torque: bool) -> Array:
    """Torque of all samples, of which that of one joint was recorded a lag (s) later."""
    torque = fits.torque.copy()
    if with_torque:
        torque[:, joint] = fits.torque_at(lag)[:, joint]
    return torque


def _shifted(signals: Signals, joint: int, lag: float) -> Signals:
    """Motion in which that of one joint was recorded a lag (s) later."""
    moved = {name: getattr(signals, name).copy() for name in ("q", "dq", "ddq")}
    for rows in signals.segments:
        clock = signals.clock[rows]
        for values in moved.values():
            values[rows, joint] = np.interp(clock + lag, clock, values[rows, joint])
    return signals.with_(**moved)
