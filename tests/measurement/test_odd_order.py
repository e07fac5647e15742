# SPDX-License-Identifier: BSD-3-Clause
"""Torques that are exchanged in a single recording."""

import pytest

from skidyn.datasets import load_scara, make_hidden_effect_log
from skidyn.logs import check_log

ROBOT = load_scara()


@pytest.mark.parametrize("effect", [None, "stribeck"])
def test_exchanged_torques_of_one_recording_are_told_alone(effect):
    frame = make_hidden_effect_log(ROBOT, effect, n_trajectories=5, random_state=2).frame
    run = frame["trajectory"].unique()[3]
    rows = frame["trajectory"] == run
    frame.loc[rows, ["tau1", "tau3"]] = frame.loc[rows, ["tau3", "tau1"]].to_numpy()
    (told,) = [s for s in check_log(frame, ROBOT).checks if s.certainty != "noted"]
    assert told.check == "odd_recording" and told.joints == (1, 3)
    assert told.suspicion.startswith(f"in trajectory {run} the torques of joint 1 (joint1) and")
