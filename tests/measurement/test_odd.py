# SPDX-License-Identifier: BSD-3-Clause
"""Single recordings whose torque is not that of the others."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.logs import check_log

ROBOT = load_planar_arm()
FRAME = make_hidden_effect_log(
    ROBOT, "stribeck", joints=[2], n_trajectories=6, duration=8.0, random_state=3
).frame
RUN = int(FRAME["trajectory"].unique()[2])


def told_of(factor, joints=("tau1", "tau2")):
    frame = FRAME.copy()
    frame.loc[frame["trajectory"] == RUN, list(joints)] *= factor
    return {s.check: s for s in check_log(frame, ROBOT).checks}


def test_recordings_that_are_alike():
    assert "odd_recording" not in told_of(1.0)


@pytest.mark.parametrize("factor", [-1.0, pytest.param(0.1, marks=pytest.mark.slow)])
def test_another_sign_or_scale(factor):
    told = told_of(factor)["odd_recording"]
    assert told.suspicion.startswith(f"in trajectory {RUN} the torque of joint 1")
    assert told.joints == (1, 2) and told.certainty == "suspected"


def test_the_sign_of_one_joint():
    assert told_of(-1.0, ["tau2"])["odd_recording"].joints == (2,)


def test_another_unit():
    told = told_of(1e3)["odd_recording"]
    assert told.certainty == "certain" and f"in trajectory {RUN} all torques" in told.suspicion


def test_the_zero_of_a_joint_in_one_recording():
    frame = FRAME.copy()
    frame.loc[frame["trajectory"] == RUN, "q2"] += 0.6
    (told,) = [s for s in check_log(frame, ROBOT).checks if s.certainty != "noted"]
    assert told.check == "odd_recording" and told.joints == (2,)
    assert f"in trajectory {RUN} the zero of joint 2 (joint2) differs by about 3" in told.suspicion


@pytest.mark.slow
def test_a_load_in_half_of_the_recordings_is_no_other_zero(checked):
    log = checked("payload", n_trajectories=6, duration=5.0, random_state=1)
    assert "odd_recording" not in {s.check for s in log.checks}


def test_a_load_of_other_recordings_does_not_hide_the_zero_of_one():
    arm = load_planar_arm()
    options = {"n_trajectories": 5, "duration": 6.0, "random_state": 6610327}
    frame = make_hidden_effect_log(arm, "payload", **options).frame
    assert not [s for s in check_log(frame, arm).checks if s.certainty != "noted"]
    frame.loc[frame["trajectory"] == 4, "q1"] -= 0.9
    (told,) = [s for s in check_log(frame, arm).checks if s.certainty != "noted"]
    assert told.check == "odd_recording" and told.joints == (1,)
    assert told.suspicion.startswith("in trajectory 4 the zero of ")


def test_a_recording_without_torque():
    frame = FRAME.copy()
    own = frame["trajectory"] == RUN
    noise = np.random.default_rng(0).normal(size=(int(own.sum()), 2))
    frame.loc[own, ["tau1", "tau2"]] = 0.01 * frame[["tau1", "tau2"]].std().to_numpy() * noise
    (told,) = [s for s in check_log(frame, ROBOT).checks if s.certainty != "noted"]
    assert (told.check, told.certainty) == ("odd_recording", "certain")
    assert told.suspicion == (
        f"in trajectory {RUN} the torques of all joints are only noise near zero"
    )


@pytest.mark.slow
def test_torques_of_joints_in_other_units_are_not_those_of_one_recording():
    frame = FRAME[FRAME["trajectory"].isin(FRAME["trajectory"].unique()[:4])].copy()
    frame[["tau1", "tau2"]] *= [14.0, 751.0]
    told = {s.check for s in check_log(frame, ROBOT).checks}
    assert "torque_scale" in told and "odd_recording" not in told
