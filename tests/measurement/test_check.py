# SPDX-License-Identifier: BSD-3-Clause
"""A check of one's own."""

import pytest

from skidyn.measurement import Check, Measurement


class Slow(Check):
    """Suspects recordings in which nothing moves fast."""

    name = "slow"
    suspects = "a recording without fast motion"

    def look(self, measurement):
        for j in range(measurement.n_joints):
            speed = abs(measurement.signals.dq[:, j]).max()
            if speed < 2.0:
                where = measurement.joint(j)
                yield self.suspicion(f"{where} is slow", f"{speed:.1f} rad/s", "noted", (j,))


def test_joints_are_counted_from_one_and_named(signals, torque):
    told = list(Slow().look(Measurement(signals, torque, None, ("shoulder", "elbow"))))
    assert [(s.check, s.joints, s.remedy) for s in told] == [
        ("slow", (1,), None),
        ("slow", (2,), None),
    ]
    assert "shoulder" in str(told[0])


def test_a_check_must_say_how_it_looks():
    with pytest.raises(TypeError, match="look"):
        type("Blind", (Check,), {"name": "blind", "suspects": ""})()
