# SPDX-License-Identifier: BSD-3-Clause
"""Scales of torques that are found together with the bodies."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.logs import check_log


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(load_ur5(), None, n_trajectories=5, duration=6.0, random_state=2)


def remedied(log, gains):
    changed = {f"tau{k}": log.frame[f"tau{k}"] / gain for k, gain in gains.items()}
    told = check_log(log.frame.assign(**changed), log.robot).checks
    (one,) = (s for s in told if s.check == "torque_scale")
    words = one.remedy.option.removeprefix("--gain ").split(",")
    return {int(word[3]): float(word.split("=")[1]) for word in words}


@pytest.mark.slow
def test_currents_are_known_against_each_other(log):
    gains = dict(zip(range(1, 7), (11.0, 23.0, 17.3, 31.0, 12.7, 44.0), strict=True))
    found = remedied(log, gains)
    shares = np.array([found[k] / gains[k] for k in range(1, 5)])
    assert shares / shares.mean() == pytest.approx(np.ones(4), abs=0.03)


@pytest.mark.slow
def test_one_gear_ratio_for_all_is_one_factor(log):
    found = remedied(log, dict.fromkeys(range(1, 7), 100.0))
    assert len(set(found.values())) == 1
    assert next(iter(found.values())) == pytest.approx(100, rel=0.1)


@pytest.mark.slow
def test_a_single_factor_is_the_round_number_near_by(log):
    assert remedied(log, {2: 0.25}) == {2: 0.25}


def test_a_payload_of_some_recordings_does_not_change_relative_scales():
    arm = load_planar_arm()
    log = make_hidden_effect_log(arm, "payload", n_trajectories=6, duration=8.0, random_state=8)
    found = remedied(log, {1: 20.0, 2: 35.0})
    assert found[1] / 20 == pytest.approx(found[2] / 35, rel=0.02)
