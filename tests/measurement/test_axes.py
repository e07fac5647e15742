# SPDX-License-Identifier: BSD-3-Clause
"""A joint about another axis than the description says."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_panda, make_hidden_effect_log
from skidyn.effects import Signals
from skidyn.logs import check_log
from skidyn.measurement import Measurement
from skidyn.measurement._axes import find_axis, turned


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(load_panda(), "payload", n_trajectories=4, duration=5.0)


@pytest.mark.parametrize("joint, direction", [(2, (0, 1, 0)), (4, (-1, 0, 0))])
def test_another_axis_of_a_joint_is_told_alone(log, joint, direction):
    claimed = turned(log.robot, joint - 1, np.array(direction, dtype=float))
    told = [s for s in check_log(log.frame, claimed).checks if s.certainty != "noted"]
    assert [s.check for s in told] == ["axes"]
    assert told[0].certainty == "certain" and told[0].joints == (joint,)
    own = " ".join(f"{x:g}" for x in log.robot.tree.axes[joint - 1])
    assert f'<axis xyz="{own}"/>' in told[0].evidence


def test_the_right_axes_are_left_alone(log):
    assert "axes" not in {s.check for s in check_log(log.frame, log.robot).checks}


def test_a_sign_is_no_axis(log):
    told = check_log(log.frame.assign(tau2=-log.frame["tau2"]), log.robot).checks
    assert "axes" not in {s.check for s in told}


def test_bodies_that_mimic_others_are_left_out(log):
    blocks = ([f"{quantity}{k + 1}" for k in range(7)] for quantity in ("q", "dq", "tau"))
    q, dq, tau = (log.frame[names].to_numpy() for names in blocks)
    number, time = (log.frame[name].to_numpy() for name in ("trajectory", "time"))
    signals = Signals(q, dq, 0 * q, number, time=time)
    fits = Measurement(signals, tau, log.robot, list("abcdefg")).fits
    doubled = replace(log.robot.tree, parents=np.append(log.robot.tree.parents, 0))
    assert find_axis(fits.of(replace(log.robot, tree=doubled))) is None
