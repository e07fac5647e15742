# SPDX-License-Identifier: BSD-3-Clause
"""Simulated faults of the torque signal."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_scara, make_hidden_effect_log

PLANAR, SCARA = load_planar_arm(), load_scara()
SHORT = {"n_trajectories": 4, "duration": 4.0}


def test_delayed_torque_belongs_to_an_earlier_position():
    log = make_hidden_effect_log(PLANAR, "time_delay", noise=0.0, **SHORT)
    prompt = make_hidden_effect_log(PLANAR, None, noise=0.0, **SHORT)
    samples = round(log.parameters["delay"] * 100)
    one, two = (x.frame.query("trajectory == 1")["q1"].to_numpy() for x in (log, prompt))
    np.testing.assert_allclose(one[:-samples], two[samples:], atol=1e-4)


def test_saturated_torque_stays_within_the_limit():
    log = make_hidden_effect_log(PLANAR, "saturation", joints=[1], **SHORT)
    assert np.abs(log.y[:, 0]).max() == pytest.approx(log.parameters["limit"][0])
