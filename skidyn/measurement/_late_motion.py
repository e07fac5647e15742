# SPDX-License-Identifier: BSD-3-Clause
"""Motion of a single joint that is late relative to the other joints and to the torque.

The torques of all joints that feel this one are then explained worse, each as if it had another
lag of its own. So the slope of the torque of identified bodies with the delay of one motion is a
column of the fit; the joint whose column promises most is refined by a fit of the shifted motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from skidyn._signals import Signals
from skidyn.measurement._joint_fit import JointFit
from skidyn.measurement._peak import peak
from skidyn.measurement._score import NEAR, SLOPE, Score, likeliest_lag

#: Log-likelihood that a slope must promise.
LEAST = 8.0


@dataclass(frozen=True)
class LateMotion:
    """Delay of position and velocity of one joint.

    Attributes
    ----------
    joint : int
        From 0.
    lag : float, s
        Positive if its motion is late.
    gain, own_gain, common_gain : float
        Log-likelihood that its removal gains, and that the removal of a delay of the torque gains,
        of the same joint and of all.
    """

    joint: int
    lag: float
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
    promised = {}
    for k in score.joints:
        moved = together.moved(_shifted(together.signals, k, SLOPE)).left(fits.torque, score.plain)
        promised[k] = score.promise(fits.average(here - moved) / SLOPE)
    k = max(promised, key=lambda k: promised[k][0])
    promise, first = promised[k]
    if promise < LEAST:
        return None

    @cache  # a search comes back to where it was
    def of_motion(lag: float) -> float:
        moved = fits.with_motion(_shifted(together.signals, k, lag))
        return score.gain(JointFit(moved, range(fits.n_joints)).fit(fits.torque))

    lag = likeliest_lag(of_motion, first)
    of_own, of_every = score.gain_of_torque([k]), score.gain_of_torque(range(fits.n_joints))
    own, every = of_own(peak(of_own, -lag, NEAR)), of_every(peak(of_every, common, NEAR))
    return LateMotion(k, lag, of_motion(lag), own, every)


def _shifted(signals: Signals, joint: int, lag: float) -> Signals:
    """Motion in which that of one joint was recorded a lag (s) later."""
    moved = {name: getattr(signals, name).copy() for name in ("q", "dq", "ddq")}
    for rows in signals.segments:
        clock = signals.clock[rows]
        for values in moved.values():
            values[rows, joint] = np.interp(clock + lag, clock, values[rows, joint])
    return signals.with_(**moved)
