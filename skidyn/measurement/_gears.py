# SPDX-License-Identifier: BSD-3-Clause
"""Factors of positions that differ from joint to joint, as before gears of different ratios.

Positions in degrees have one factor, at which the torque is explained best whatever else is wrong.
Positions of motors may by chance look like degrees, since gears of robots have ratios near 57. From
the factor of degrees on, those of the joints are changed one after another to what explains the
torque best; they are others only if this explains far more.
"""

from __future__ import annotations

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._fits import Fits
from skidyn.measurement._outcome import Outcome
from skidyn.measurement._reading import Reading

#: Factors of a joint that are tried, relative to what is known, with both signs, in the rounds in
#: which all are searched, and in those that sharpen them.
WIDE, FINE = 1.12 ** np.arange(-6, 14), (1.03 ** np.arange(-4, 5), 1.01 ** np.arange(-4, 5))
#: Log-likelihood that factors must gain, and the share of the residual of a joint that they leave.
DECISIVE, HALF = 60.0, 0.5
#: Rounds over all joints at wide steps once factors are found to differ.
ROUNDS = 2


def factors_of_joints(fits: Fits, joints: list[int], size: float) -> tuple[Array, float] | None:
    """Factor of the position of every joint, and their gain; None if one factor explains as much.

    Parameters
    ----------
    fits : Fits
        Rows.
    joints : list of int
        Joints, from 0, whose positions have a factor.
    size : float
        Common factor, against which others are tested.

    Returns
    -------
    factors : ndarray of shape (n_joints,)
        To be divided out of the positions; 1 for other joints.
    gain : float
        Log-likelihood gained over the common factor.
    """
    few = fits.few.with_loads()
    factors = np.ones(fits.n_joints)
    factors[joints] = size
    common = _read(few, factors)
    steps = np.concatenate([WIDE, -WIDE])
    best = common
    for joint in joints:
        factors, best = _improved(few, factors, joint, steps, best)
    halved = best.scale[joints] < HALF * common.scale[joints]
    if best.gained_over(common) < DECISIVE or not halved.any():
        return None
    for tried in (*([steps] * (ROUNDS - 1)), *(np.append(fine, -1.0) for fine in FINE)):
        for joint in joints:
            factors, best = _improved(few, factors, joint, tried, best)
    return factors, best.gained_over(common)


def _read(fits: Fits, factors: Array) -> Outcome:
    """Identified bodies at some factors of the positions."""
    s = fits.signals
    motion = s.with_(q=s.q / factors, dq=s.dq / factors, ddq=s.ddq / factors)
    return fits.with_motion(motion).identified(Reading())


def _improved(
    fits: Fits, factors: Array, joint: int, steps: Array, best: Outcome
) -> tuple[Array, Outcome]:
    """Factors with that of one joint multiplied by the step that explains the torque best."""
    found = factors
    for step in steps:
        other = factors.copy()
        other[joint] *= step
        outcome = _read(fits, other)
        if outcome.gained_over(best) > 0:
            found, best = other, outcome
    return found, best
