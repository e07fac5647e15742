# SPDX-License-Identifier: BSD-3-Clause
"""Size of a robot all of whose torques are at another scale than those of its description.

Torques grow with the fourth power of the size of a robot at least, so that the description of
another size looks like torques in another unit. But then bodies of any mass explain the torque as
it is only with other lengths, and a unit needs none.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from skidyn.measurement._fits import Fits
from skidyn.measurement._lengths import stretched
from skidyn.measurement._peak import peak
from skidyn.measurement._reading import Reading

#: Logarithms of the sizes that are tried, and distance of the points of a parabola.
TRIED, NEAR = np.linspace(-0.5, 0.5, 21), 0.01
#: Log-likelihood that another size must gain over the stated one, and over gains of the torques.
LEAST = 15.0


def find_size(fits: Fits, factors: Mapping[int, float]) -> tuple[float, float] | None:
    """Size of the robot relative to its description, and its log-likelihood gain.

    None if the stated size explains the torque as well, or with the factors that would be suggested
    for it.

    Parameters
    ----------
    fits : Fits
        Rows.
    factors : mapping of int to float
        Factors of torques, by joint from 0.
    """
    bodies = np.flatnonzero(fits.robot.tree.parents >= 0).tolist()
    few = fits.few

    def sized(rows: Fits, log: float) -> Fits:
        return rows.of(stretched(rows.robot, bodies, np.full(len(bodies), log)))

    def likelihood(rows: Fits, log: float) -> float:
        return float(sized(rows, log).identified(Reading()).likelihood.sum())

    first = max(TRIED, key=lambda log: likelihood(few, float(log)))
    log = peak(lambda log: likelihood(fits, log), float(first), NEAR)
    there = sized(fits, log).identified(Reading())
    gain = there.gained_over(fits.identified(Reading()))
    scaled = fits.scaled({k: 1 / factor for k, factor in factors.items()})
    change = there.margin(scaled.identified(Reading()))
    for k, factor in factors.items():  # the density of a torque is that of the scaled one, times it
        rows = float(fits.moving[:, k].sum())
        change[k] -= rows * np.log(factor) / there.inflation_of(k)
    if min(gain, float(change.sum())) < LEAST:
        return None
    return float(np.exp(log)), gain
