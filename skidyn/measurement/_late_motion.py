# SPDX-License-Identifier: BSD-3-Clause
"""Motion of a single joint that is late relative to the other joints and to the torque.

The torques of all joints that feel this one are then explained worse, each as if it had another
lag of its own. So the slope of the torque of identified bodies with the delay of one motion is a
column of the fit; the joint whose column gains most is refined by a fit of the shifted motion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from skidyn._signals import Signals
from skidyn.measurement._delay import JointFit
from skidyn.measurement._fits import Fits
from skidyn.measurement._peak import peak
from skidyn.measurement._robust import RobustFit, fit_together

#: Delay for a slope, and the distance of the delays of a parabola, s.
SLOPE, NEAR = 2e-3, 4e-3


@dataclass(frozen=True)
class LateMotion:
    """Delay of position and velocity of one joint.

    Attributes
    ----------
    joint : int
        From 0.
    lag : float, s
        Positive if its motion is late.
    gain, torque_gain : float
        Log-likelihood that its removal gains, and that the removal of a delay of the torque, of the
        same joint or of all, gains at most.
    """

    joint: int
    lag: float
    gain: float
    torque_gain: float


def find_late_motion(fits: Fits, common: float) -> LateMotion | None:
    """The joint whose motion explains all torques best at another time; None without rows.

    Parameters
    ----------
    fits : Fits
        Rows.
    common : float, s
        Lag of all torques, about.
    """
    together = JointFit(fits, range(fits.n_joints))
    if not together.joints:
        return None
    plain = together.fit(fits.torque)
    inflation = [max(fit.inflation, 1.0) for fit in plain]

    def gain(fitted: list[RobustFit]) -> float:
        gained = zip(fitted, plain, inflation, strict=True)
        return sum((there.likelihood - here.likelihood) / i for there, here, i in gained)

    slopes = {k: _with_slope(together, plain, k) for k in together.joints}
    k = max(slopes, key=lambda k: gain(slopes[k]))

    def of_motion(lag: float) -> float:
        moved = fits.with_motion(_shifted(together.signals, k, lag))
        return gain(JointFit(moved, range(fits.n_joints)).fit(fits.torque))

    def of_torque(changed: JointFit, start: float) -> float:
        def gained(lag: float) -> float:
            return gain(changed.fit(fits.torque_at(lag)))

        return gained(peak(gained, start, NEAR))

    first = float(slopes[k][0].coefficients[-1])
    lag = peak(of_motion, first, NEAR)
    rivals = of_torque(JointFit(fits, [k]), -first), of_torque(together, common)
    return LateMotion(k, lag, of_motion(lag), max(rivals))


def _with_slope(together: JointFit, plain: list[RobustFit], joint: int) -> list[RobustFit]:
    """Fits with the slope of the torque with the delay of the motion of a joint as last column."""
    fits, last = together.fits, 1 + max(int(place.max()) for place in together.places)
    here = together.left(fits.torque, plain)
    there = together.moved(_shifted(together.signals, joint, SLOPE)).left(fits.torque, plain)
    slope = fits.average(here - there) / SLOPE
    designs = [
        np.column_stack([design, slope[use, column]])
        for column, (design, use) in enumerate(zip(together.designs, together.rows, strict=True))
    ]
    torque = fits.average(fits.torque)
    targets = [torque[use, j] for j, use in zip(together.joints, together.rows, strict=True)]
    return fit_together(designs, [np.append(place, last) for place in together.places], targets)


def _shifted(signals: Signals, joint: int, lag: float) -> Signals:
    """Motion in which that of one joint was recorded a lag (s) later."""
    moved = {name: getattr(signals, name).copy() for name in ("q", "dq", "ddq")}
    for rows in signals.segments:
        clock = signals.clock[rows]
        for values in moved.values():
            values[rows, joint] = np.interp(clock + lag, clock, values[rows, joint])
    return signals.with_(**moved)
