# SPDX-License-Identifier: BSD-3-Clause
"""Check for torques of the motors of a differential in place of those of its joints.

Both joints of a wrist with bevel gears are driven by both motors. The torque of one joint is the
sum of the torques of the motors, that of the other their difference, or half of them, as the motors
are said to turn. Each motor alone looks like a torque at another scale, which no gain corrects.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._check import Check
from skidyn.measurement._copies import copied_columns
from skidyn.measurement._fits import Fits
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._reading import Reading
from skidyn.measurement._robust import fit_admissible
from skidyn.measurement._suspicion import Suspicion, remedy_of

#: Log-likelihood that sum and difference must gain over any sign and order of the two torques, with
#: the stated bodies, whose torque may be small beside friction, and with identified ones.
LEAST, SURE = 15.0, 40.0
#: Share of the sum and of the difference that is a torque.
SHARES = (1.0, 0.5)


@dataclass(frozen=True)
class Differential:
    """Torques of two joints from those of two motors.

    Attributes
    ----------
    joints : (int, int)
        From 0.
    rows : ndarray of shape (2, 2)
        Factors of both columns, for the torque of each joint.
    stated, identified : float
        Log-likelihood gain with the stated and with identified bodies.
    """

    joints: tuple[int, int]
    rows: Array
    stated: float
    identified: float

    @property
    def sums(self) -> dict[str, str]:
        """Sum of columns for every joint."""
        columns = [f"tau{k + 1}" for k in self.joints]
        return dict(zip(columns, (_sum(row, columns) for row in self.rows), strict=True))


class MotorsOfDifferential(Check):
    """Torques of two motors that drive two joints together."""

    name = "differential"
    of_sensor = True
    suspects = "torques of the two motors of a differential instead of those of its joints"
    stage = 1
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        fits = measurement.fits
        if fits is None or measurement.odd or not np.any(fits.robot.inertial_parameters):
            return
        lost = [*measurement.clipped, *measurement.overflowed]
        lost += [k for k, _, _ in copied_columns(measurement)]
        found = find_differential(fits.without(lost))
        if found is None:
            return
        measurement.mixed = True
        names = measurement.joints(found.joints)
        yield self.suspicion(
            f"the torques of {names} are those of the two motors of a differential",
            "their sum and difference agree with the torques of the stated bodies better than the "
            f"torques themselves, in any order and with any signs, by {found.stated:.0f} "
            f"(log-likelihood), and with those of identified bodies by {found.identified:.0f}; "
            "gears of another ratio need a gain as well",
            "suspected",
            found.joints,
            remedy_of("combine", found.sums),
        )


def find_differential(fits: Fits) -> Differential | None:
    """Two neighbouring joints whose torques are the sum and the difference of two columns.

    Parameters
    ----------
    fits : Fits
        Rows.
    """
    turning = ~fits.signals.prismatic
    best: tuple[float, tuple[int, int], Array, Array] | None = None
    for a in range(fits.n_joints - 1):
        pair = (a, a + 1)
        if not all(fits.usable(k) and turning[k] for k in pair):
            continue
        gain, mixed, plain = _of_pair(fits, pair)
        if gain > LEAST and (best is None or gain > best[0]):
            best = gain, pair, mixed, plain
    if best is None:
        return None
    stated, pair, mixed, plain = best
    rows = float(sum(fits.moving[:, k].sum() for k in pair))
    columns = list(pair)

    def fitted(factors: Array) -> Fits:
        torque = fits.torque.copy()
        torque[:, columns] = torque[:, columns] @ factors.T
        return fits.with_torque(torque)

    here = fitted(plain).identified(Reading())
    judged = []
    for share in SHARES:
        there = fitted(share * mixed).identified(Reading())
        # the density of two torques is that of their combinations times the determinant
        spread = 0.5 * rows * np.log(2 * share**2) / max(there.inflation_of(k) for k in pair)
        judged.append((there.gained_over(here) + spread, share))
    gain = max(judged)[0]
    if gain < SURE:
        return None
    # identified bodies do not tell the share where no other joint moves them
    nominal = fitted(mixed).nominal(Reading()).gain[columns]
    size = float(np.log(np.median(nominal[nominal > 0]))) if np.any(nominal > 0) else 0.0
    likely = [share for own, share in judged if own > gain - LEAST]
    share = min(likely, key=lambda share: abs(np.log(share) + size))
    return Differential(pair, share * mixed, stated, gain)


def _of_pair(fits: Fits, pair: tuple[int, int]) -> tuple[float, Array, Array]:
    """Gain of the best sum and difference over the best order and signs, and both as factors."""
    columns = fits.columns(Reading())
    torque = np.stack([fits.mean_torque(k)[0] for k in pair], axis=1)
    vectors = {"own": (1.0, 0.0), "other": (0.0, 1.0), "sum": (1.0, 1.0), "difference": (1.0, -1.0)}
    found: dict[tuple[int, str], tuple[float, Array, float]] = {}
    for (place, k), (name, vector), sign in product(enumerate(pair), vectors.items(), (1.0, -1.0)):
        use = fits.moving[:, k]
        factors = sign * np.array(vector)
        fit = fit_admissible(columns[use, :, k], torque[use] @ factors)
        # a sum of two noises is larger by the root of two, as is the determinant
        scaled = fit.likelihood + len(fit.residual) * np.log(np.linalg.norm(factors))
        if (place, name) not in found or scaled > found[place, name][0]:
            found[place, name] = scaled, factors, fit.inflation

    def best(*pairs: tuple[str, str]) -> tuple[float, Array, float]:
        tried = [(found[0, one], found[1, other]) for one, other in pairs]
        chosen = max(tried, key=lambda both: both[0][0] + both[1][0])
        likelihood = chosen[0][0] + chosen[1][0]
        return likelihood, np.stack([x[1] for x in chosen]), max(x[2] for x in chosen)

    plain, signs, _ = best(("own", "other"), ("other", "own"))
    mixed, factors, inflation = best(("sum", "difference"), ("difference", "sum"))
    return (mixed - plain) / inflation, factors, signs


def _sum(row: Array, columns: list[str]) -> str:
    """A sum of columns as text: tau6-tau7."""
    terms = [
        f"{'-' if x < 0 else '+'}{'' if abs(x) == 1 else f'{abs(x):g}*'}{name}"
        for x, name in zip(row, columns, strict=True)
    ]
    return "".join(terms).removeprefix("+")
