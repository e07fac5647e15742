# SPDX-License-Identifier: BSD-3-Clause
"""Channels that are copies of others."""

import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.exceptions import LogError
from skidyn.identification import RBDRegressor
from skidyn.logs import check_log

ROBOT = load_planar_arm()
FRAME = make_hidden_effect_log(ROBOT, None, n_trajectories=4, random_state=4).frame


def told_of(frame):
    return {s.check: s for s in check_log(frame, ROBOT).checks}


def test_channels_of_their_own():
    assert "copied_torque" not in told_of(FRAME)


def test_torque_of_another_joint():
    told = told_of(FRAME.assign(tau2=2.0 * FRAME["tau1"]))["copied_torque"]
    assert told.certainty == "suspected" and told.joints == (1, 2)


@pytest.mark.parametrize(("channel", "name"), [("dq2", "velocity"), ("q2", "position")])
def test_a_channel_that_is_no_torque(channel, name):
    frame = FRAME.assign(tau2=FRAME[channel])
    told = told_of(frame)["copied_torque"]
    assert told.certainty == "certain" and f"is the {name} of joint 2" in told.suspicion
    with pytest.raises(LogError, match="does not agree with its names and units"):
        diagnose(RBDRegressor(ROBOT), frame, frame[["tau1", "tau2"]].to_numpy())
