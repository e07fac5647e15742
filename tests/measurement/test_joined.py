# SPDX-License-Identifier: BSD-3-Clause
"""Recordings that were joined, and positions that jump."""

import numpy as np


def test_joined_recordings_are_told_once_and_cut_for_other_checks(signals, torque, found, only):
    kept = np.r_[0:700, 1250:2000]
    joined = signals.take(kept).with_(time=signals.time[: len(kept)])
    only(found(joined, torque[kept]), "joined", "certain", "--split-leaps")


def test_an_encoder_that_loses_steps(signals, torque, found):
    q = signals.q.copy()
    for row in (500, 900, 1300):
        q[row:, 1] += 0.3
    told = {s.check: s for s in found(signals.with_(q=q), torque)}["joined"]
    assert told.joints == (2,) and "loses steps" in told.suspicion and told.remedy is None


def test_a_position_that_is_stuck_before_it_jumps(signals, torque, found):
    q = signals.q.copy()
    for row in (500, 1300):
        q[row : row + 60, 1] = q[row, 1]
    told = {s.check: s for s in found(signals.with_(q=q), torque)}["joined"]
    assert told.joints == (2,) and "stuck in parts" in told.suspicion
