# SPDX-License-Identifier: BSD-3-Clause
"""Check for positions that jump and continue from there."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._suspicion import Suspicion, remedy_of

#: Rows in which the position of a joint does not change before it jumps.
STUCK = 10
#: Velocity of a joint that moves while another one jumps, as a share of its largest, and share of
#: the jumps at which some joint does.
MOVING, MOST_MOVE = 0.05, 0.5


class JoinedRecordings(Check):
    """Positions that jump and continue from there: joined recordings, or missing parts."""

    name = "joined"
    suspects = (
        "recordings that were joined into one, or from which a part was cut out; positions of a "
        "joint whose encoder loses its zero"
    )

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        s = measurement.signals
        rows = measurement.leaps
        if len(rows) and not measurement.lost:  # lost rows make positions jump as well
            shown = ", ".join(str(int(row)) for row in rows[:6]) + (" .." if len(rows) > 6 else "")
            joint = int(np.argmax(np.abs(s.q[rows[0]] - s.q[rows[0] - 1])))
            if _was_held(measurement, joint):
                yield self.suspicion(
                    f"the position of {measurement.joint(joint)} is stuck in parts of recordings",
                    f"it does not change in {STUCK} rows or more before it jumps in {len(rows)} "
                    f"place(s) (rows {shown}); leave these parts out",
                    "certain",
                    [joint],
                )
                return
            if _of_one_joint(measurement, joint):
                yield self.suspicion(
                    f"the zero of the position of {measurement.joint(joint)} changes within "
                    "recordings: its encoder loses steps",
                    f"it jumps in {len(rows)} place(s) farther than any velocity implies, and "
                    f"continues from there (rows {shown}), while other joints move on evenly; "
                    "home the joint again and record anew, or leave these recordings out",
                    "certain",
                    [joint],
                )
                return
            yield self.suspicion(
                "recordings were joined, or a part was cut out of one",
                f"positions jump in {len(rows)} place(s) farther than any velocity implies, and "
                f"continue from there (rows {shown}; {measurement.joint(joint)} by "
                f"{abs(s.q[rows[0], joint] - s.q[rows[0] - 1, joint]):.3g})",
                "certain",
                remedy=remedy_of("split_leaps", True),
            )


def _was_held(measurement: Measurement, joint: int) -> bool:
    """Whether the position of a joint, from 0, was constant before most jumps."""
    q, rows = measurement.signals.q[:, joint], measurement.leaps
    rows = rows[rows > STUCK]
    held = [np.ptp(q[row - STUCK : row]) == 0 and q[row] != q[row - 1] for row in rows]
    others = np.delete(measurement.signals.q, joint, axis=1)
    move = [np.ptp(others[row - STUCK : row], axis=0).any() for row in rows]
    return bool(held) and min(np.mean(held), np.mean(move)) >= MOST_MOVE


def _of_one_joint(measurement: Measurement, joint: int) -> bool:
    """Whether a joint, from 0, jumps alone while others move; joined recordings differ in all."""
    s, rows = measurement.signals, measurement.leaps
    expected = s.dq[rows] * (s.clock[rows] - s.clock[rows - 1])[:, None]
    moved = s.q[rows] - s.q[rows - 1]
    others = np.arange(s.n_joints) != joint
    # a trajectory ends before a jump
    usual = np.abs(np.diff(s.q, axis=0))[s.within].max(axis=0, initial=0.0)
    even = np.abs(moved - expected) <= usual
    fast = np.abs(s.dq[rows]) > MOVING * np.abs(s.dq).max(axis=0)
    alone = ~even[:, joint] & even[:, others].all(axis=1)
    return bool(alone.all() and np.any(fast[:, others], axis=1).mean() > MOST_MOVE)
