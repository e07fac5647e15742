# SPDX-License-Identifier: BSD-3-Clause
"""Check for crosstalk: a share of the torque of one joint in the channel of another.

The noise of two torque sensors is independent. If that of one channel contains a share of that of
another, and the same share, which then is no free parameter, also explains its slow torque, the
channels are not separate. Effects that couple joints act through their motion, and leave the noise
alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from skidyn._signals import Array, scatter
from skidyn.measurement._check import Check
from skidyn.measurement._fits import Fits
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._reading import Reading
from skidyn.measurement._suspicion import Suspicion
from skidyn.measurement._torque import readable_fits

#: Order of the differences that are noise, and residuals in their spread at which they are cut.
ORDER, CUT = 3, 3.0
#: Standard errors that a share of noise must have, and the least and largest share.
ERRORS, LEAST, MOST = 6.0, 0.02, 1.0
#: Log-likelihood that the slow torque must gain with the share of the noise, over none and over
#: twice that share.
SURE = 25.0


@dataclass(frozen=True)
class Share:
    """Share of one torque in the channel of another joint.

    Attributes
    ----------
    joint, source : int
        Channel that contains the share, and that of the torque, from 0.
    share, error : float
        Share of the noise, with its standard error.
    gain : float
        Log-likelihood gain of the slow torque without this share.
    """

    joint: int
    source: int
    share: float
    error: float
    gain: float


class Crosstalk(Check):
    """A torque that contains a share of the torque of another joint."""

    name = "crosstalk"
    of_sensor = True
    suspects = "torque that contains a share of the torque of another joint"
    stage = 2

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        fits = readable_fits(measurement)
        if fits is None or measurement.stale or measurement.computed or measurement.odd:
            return
        for one in find_shares(measurement, fits):
            # drives of a wrist are often coupled, and with them the currents of their motors
            coupled = abs(one.joint - one.source) == 1
            yield self.suspicion(
                f"the torque of {measurement.joint(one.joint)} contains {100 * one.share:.0f} % of "
                f"that of {measurement.joint(one.source)}"
                + (", or their drives are coupled" if coupled else ""),
                f"its noise contains this share (standard error {100 * one.error:.1f} %), and "
                "without it, bodies and friction explain the torque better by "
                f"{one.gain:.0f} (log-likelihood); calibrate the torque channels together",
                "noted" if coupled else "suspected",
                [one.joint, one.source],
            )


def find_shares(measurement: Measurement, fits: Fits) -> list[Share]:
    """Shares of torques in other channels, the one that explains most first.

    Parameters
    ----------
    measurement : Measurement
        Recording, with the noise of the torque.
    fits : Fits
        Its rows.
    """
    joints = [k for k in range(fits.n_joints) if fits.usable(k)]
    found: list[Share] = []
    noise = _noise(measurement, joints)
    if noise is None:
        return found
    tried = _noise_shares(noise, joints)
    while tried:
        here = fits.identified(Reading())
        judged = []
        for joint, source, share, error in tried:
            once, twice = (
                without(fits, joint, source, x).identified(Reading()).gained_over(here)
                for x in (share, 2 * share)
            )
            if min(once, once - twice) > SURE:
                judged.append(Share(joint, source, share, error, once))
        if not judged or len(found) >= fits.n_joints:
            break
        best = max(judged, key=lambda one: one.gain)
        found.append(best)
        fits = without(fits, best.joint, best.source, best.share)
        # noise goes from one channel to another, and seems to come from either
        pair = {best.joint, best.source}
        tried = [one for one in tried if {one[0], one[1]} != pair]
    return found


def without(fits: Fits, joint: int, source: int, share: float) -> Fits:
    """The same rows with a share of one torque subtracted from another.

    Parameters
    ----------
    fits : Fits
        Rows.
    joint, source : int
        Channels, from 0.
    share : float
        Share of the torque of the source.
    """
    torque = fits.torque.copy()
    torque[:, joint] -= share * torque[:, source]
    return fits.with_torque(torque)


def _noise(measurement: Measurement, joints: list[int]) -> Array | None:
    """Differences of the torques, which motion hardly reaches, cut at outliers."""
    torque, number = measurement.torque[:, joints], measurement.signals.trajectory
    noise = np.diff(torque, n=ORDER, axis=0)[number[ORDER:] == number[:-ORDER]]
    spread = scatter(noise, axis=0)
    if len(noise) < 500 or len(joints) < 2 or not np.all(spread > 0):
        return None
    return np.asarray(np.clip(noise / spread, -CUT, CUT) * spread)


def _noise_shares(noise: Array, joints: list[int]) -> list[tuple[int, int, float, float]]:
    """Channel, source, share and standard error of every significant share of noise."""
    found = []
    # neighbouring differences of white noise are correlated
    kernel = np.diff(np.eye(1, 2 * ORDER + 1, ORDER)[0], n=ORDER)
    correlation = np.convolve(kernel, kernel[::-1])
    alike = float(np.sum((correlation / correlation.max()) ** 2))
    size = noise.T @ noise
    for i, joint in enumerate(joints):
        for j, source in enumerate(joints):
            if i == j:
                continue
            share = float(size[i, j] / size[j, j])
            rest = max(float(size[i, i] - share * size[i, j]), 0.0) / len(noise)
            error = float(np.sqrt(rest * alike / size[j, j]))
            if abs(share) > ERRORS * error and LEAST < abs(share) < MOST:
                found.append((joint, source, share, error))
    return found
