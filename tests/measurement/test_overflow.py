# SPDX-License-Identifier: BSD-3-Clause
"""Torque that continues at the other end of its range."""

import numpy as np


def test_torque_that_overflows(signals, torque, found):
    limit = 0.8 * np.abs(torque[:, 0]).max()
    wrapped = (torque[:, 0] + limit) % (2 * limit) - limit
    told = [s for s in found(signals, np.column_stack([wrapped, torque[:, 1]])) if s.joints == (1,)]
    assert told[0].check == "overflowed_torque" and told[0].certainty == "suspected"
    assert "torque_scale" not in [s.check for s in told]


def test_dry_friction_that_jumps_as_far_does_not_overflow(signals, found):
    friction = 3.0 * np.sign(signals.dq)
    assert "overflowed_torque" not in [s.check for s in found(signals, friction, None)]
