# SPDX-License-Identifier: BSD-3-Clause
"""Time stamps that jitter, and rows that repeat."""

import numpy as np

from skidyn.datasets import make_hidden_effect_log
from skidyn.effects import Signals


def test_repeated_rows(signals, torque, found):
    held = np.arange(len(signals.q)) // 2 * 2
    repeated = signals.with_(q=signals.q[held], dq=signals.dq[held])
    told = {s.check: s for s in found(repeated, torque)}
    assert told["repeated_rows"].remedy.option == "--drop-repeated"


def test_clock_that_jitters(signals, torque, found):
    stamps = signals.time + np.random.default_rng(1).uniform(-1e-3, 1e-3, len(signals.time))
    told = {s.check: s for s in found(signals.with_(time=stamps), torque)}
    assert told["clock_jitter"].certainty == "certain"
    assert told["clock_jitter"].remedy.option == "--clock regular"


def test_samples_that_really_were_uneven(found):
    rng = np.random.default_rng(2)
    t = np.cumsum(rng.uniform(0.004, 0.016, 3000))
    phase = t[:, None] * [0.7, 1.3]
    motion = Signals(
        np.sin(phase), np.cos(phase) * [0.7, 1.3], 0 * phase, np.zeros(3000, int), time=t
    )
    told = {s.check: s for s in found(motion, phase, None)}
    assert told["clock_jitter"].certainty == "noted" and told["clock_jitter"].remedy is None


def test_stamps_are_certain_only_where_they_do_harm(arm, told_of):
    log = make_hidden_effect_log(arm, None, n_trajectories=4, random_state=6)
    noise = np.random.default_rng(0).uniform(-1, 1, len(log.frame))
    certainties = {
        size: told_of(log.frame.assign(time=log.frame["time"] + size * noise))["clock_jitter"]
        for size in (2e-5, 1e-3)
    }
    assert certainties[2e-5].certainty == "suspected"
    assert "little harm" in certainties[2e-5].evidence
    assert certainties[1e-3].certainty == "certain"
