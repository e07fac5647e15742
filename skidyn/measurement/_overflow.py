# SPDX-License-Identifier: BSD-3-Clause
"""Check of torque that overflows."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, Signals
from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._suspicion import Suspicion

#: Jump of a torque that overflows, as a share of its range, and how many at least; the largest of
#: its other steps; what is near an end of the range; least speed of rows that count, and the share
#: of jumps in such rows.
ACROSS, OVERFLOWS, SMALL, END, SLOW, MOSTLY = 0.8, 5, 0.25, 0.1, 0.02, 0.5


class OverflowedTorque(Check):
    """A torque that continues at the other end of its range: a counter that overflows."""

    name = "overflowed_torque"
    of_sensor = True
    suspects = "torque that continues at the other end of its range, as a counter that overflows"
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        for k, jumps in measurement.overflowed.items():
            torque = measurement.torque[:, k]
            yield self.suspicion(
                f"the torque of {measurement.joint(k)} overflows",
                f"it jumps {jumps} times from one end of its range ({torque.min():.4g} to "
                f"{torque.max():.4g}) to the other while the joint moves in one direction, and is "
                "continuous if the ends are joined; add the range to one side of each jump",
                "suspected",
                [k],
            )


def overflowed_columns(s: Signals, torques: Array) -> dict[int, int]:
    """Joints whose torque overflows, from 0, and how often it jumps.

    Parameters
    ----------
    s : Signals
        Recorded motion.
    torques : ndarray of shape (n_samples, n_joints), N m or N
        Recorded torque.
    """
    jumps = {k: _overflows(torque, s.dq[:, k], s.within) for k, torque in enumerate(torques.T)}
    return {k: count for k, count in jumps.items() if count >= OVERFLOWS}


def _overflows(torque: Array, velocity: Array, together: NDArray[np.bool_]) -> int:
    """Jumps from one end of the range of a torque to the other; 0 where they are of friction."""
    span, change = float(np.ptp(torque)), np.diff(torque)
    if span <= 0:
        return 0
    far = (np.abs(change) > ACROSS * span) & together
    # from one end to the other, and not to the zero of a lost sample
    near = np.minimum(torque - torque.min(), torque.max() - torque) < END * span
    far &= near[1:] & near[:-1]
    if not far.any():
        return 0
    usual = float(np.quantile(np.abs(change[~far & together]), 0.99)) if np.any(~far) else span
    # dry friction that is all of a torque jumps likewise, but where the joint turns
    one_way = np.sign(velocity[1:]) == np.sign(velocity[:-1])
    one_way &= np.minimum(*np.abs([velocity[1:], velocity[:-1]])) > SLOW * np.abs(velocity).max()
    if usual > SMALL * span or np.mean(one_way[far]) < MOSTLY:
        return 0
    return int(far.sum())
