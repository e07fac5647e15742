# SPDX-License-Identifier: BSD-3-Clause
"""Motion of a single joint that is late relative to the other joints and to the torque.

The torques of all joints that feel this one are then explained worse, each as if it had another
lag of its own. So the slope of the torque of identified bodies with the delay of one motion is a
column of the fit; the joint whose column gains most is refined by a fit of the shifted motion. What
a column gains beside others follows from the residual without it, so that most logs need one fit.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from skidyn._signals import Signals
from skidyn.measurement._delay import JointFit
from skidyn.measurement._fits import Fits
from skidyn.measurement._near_bodies import Factored
from skidyn.measurement._peak import peak
from skidyn.measurement._robust import RobustFit, robust_weights

#: Delay for a slope, and the distance of the delays of a parabola, s.
SLOPE, NEAR = 2e-3, 4e-3
#: Log-likelihood that a slope must promise, and the least share of it that bodies do not follow.
LEAST, ALONE = 8.0, 1e-6


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


def find_late_motion(fits: Fits, common: float) -> LateMotion | None:
    """The joint whose motion explains all torques best at another time.

    None without rows, or where the slope of no joint promises a gain.

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
    promised = _promised(together, plain, inflation)
    k = max(promised, key=lambda k: promised[k][0])
    promise, first = promised[k]
    if promise < LEAST:
        return None

    def gain(fitted: list[RobustFit]) -> float:
        gained = zip(fitted, plain, inflation, strict=True)
        return sum((there.likelihood - here.likelihood) / i for there, here, i in gained)

    @cache  # a search comes back to where it was
    def of_motion(lag: float) -> float:
        moved = fits.with_motion(_shifted(together.signals, k, lag))
        return gain(JointFit(moved, range(fits.n_joints)).fit(fits.torque))

    def of_torque(changed: JointFit, start: float) -> float:
        def gained(lag: float) -> float:
            return gain(changed.fit(fits.torque_at(lag)))

        return gained(peak(gained, start, NEAR))

    # where a motion is late, the weights of its rows are small, and so is the first delay
    first = max((first, 1.5 * first, 2 * first), key=of_motion)
    lag = peak(of_motion, first, NEAR)
    own, every = of_torque(JointFit(fits, [k]), -lag), of_torque(together, common)
    return LateMotion(k, lag, of_motion(lag), own, every)


def _promised(
    together: JointFit, plain: list[RobustFit], inflation: list[float]
) -> dict[int, tuple[float, float]]:
    """Log-likelihood gain and delay of every joint's motion, from the slope of the torque with it.

    It is that of one more column for the residual of the fit without it, at the weights of that.
    """
    fits, size = together.fits, 1 + max(int(place.max()) for place in together.places)
    weights = [robust_weights(fit) / i for fit, i in zip(plain, inflation, strict=True)]
    gram = np.zeros((size, size))
    for design, place, weight in zip(together.designs, together.places, weights, strict=True):
        gram[np.ix_(place, place)] += (design.T * weight) @ design
    factor = Factored(gram)
    here = together.left(fits.torque, plain)
    promised = {}
    for k in together.joints:
        moved = together.moved(_shifted(together.signals, k, SLOPE)).left(fits.torque, plain)
        slope = fits.average(here - moved) / SLOPE
        own, right, cross = 0.0, 0.0, np.zeros(size)
        for j, (use, fit, weight) in enumerate(zip(together.rows, plain, weights, strict=True)):
            column = slope[use, j]
            own += float(weight @ column**2)
            right += float((weight * column) @ fit.residual)
            cross[together.places[j]] += together.designs[j].T @ (weight * column)
        rest = own - float(cross @ factor.solve(cross))
        if rest > ALONE * own:
            promised[k] = 0.5 * right**2 / rest, right / rest
    return promised or {together.joints[0]: (0.0, 0.0)}


def _shifted(signals: Signals, joint: int, lag: float) -> Signals:
    """Motion in which that of one joint was recorded a lag (s) later."""
    moved = {name: getattr(signals, name).copy() for name in ("q", "dq", "ddq")}
    for rows in signals.segments:
        clock = signals.clock[rows]
        for values in moved.values():
            values[rows, joint] = np.interp(clock + lag, clock, values[rows, joint])
    return signals.with_(**moved)
