# SPDX-License-Identifier: BSD-3-Clause
"""Check of a description as a whole: whether it is that of another robot.

Bodies near those of the right description leave what any bodies leave, whatever effect is missing.
Those of another robot leave far more on several joints, and its links have other lengths as well,
beyond what a variant of a robot has.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from skidyn.measurement._check import Check
from skidyn.measurement._lengths import FARTHEST, LEAST_COARSE, asked_lengths
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._near_bodies import left_by_near_bodies
from skidyn.measurement._suspicion import Suspicion


class OtherRobot(Check):
    """A description that is not of this robot."""

    name = "other_robot"
    suspects = "the description of another robot"
    stage = 2
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        found = asked_lengths(measurement)
        if found is None or found.gain < LEAST_COARSE or np.abs(found.factors).max() < FARTHEST:
            return
        left = left_by_near_bodies(found.here)
        if not left:
            return
        ratios = ", ".join(f"{left[k]:.2g} times on {measurement.joint(k)}" for k in left)
        yield self.suspicion(
            "the description is not of this robot",
            "even with masses that are off by a third, its bodies leave more than any others, "
            f"{ratios}, and other lengths of links explain the torque better by {found.gain:.0f} "
            "(log-likelihood), but only far from the stated ones; use the description of this "
            "robot",
            "suspected",
            left,
        )
