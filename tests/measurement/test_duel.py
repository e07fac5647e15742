# SPDX-License-Identifier: BSD-3-Clause
"""A reading of a log against physical effects that could look like it."""

import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.logs import check_log

ROBOT = load_ur5()


def log_of(kind=None, joints=None, n_trajectories=4, duration=6.0, random_state=2):
    words = {} if joints is None else {"joints": joints}
    return make_hidden_effect_log(
        ROBOT,
        kind,
        n_trajectories=n_trajectories,
        duration=duration,
        random_state=random_state,
        **words,
    ).frame


PLAIN = log_of()
SPRUNG = log_of("coupling_spring", [3, 4])


def readings(frame, robot=ROBOT):
    """Other readings of a log that are told."""
    return [s for s in check_log(frame, robot).checks if s.check == "reading"]


@pytest.mark.parametrize(
    "frame",
    [pytest.param(PLAIN, id="plain", marks=pytest.mark.slow), pytest.param(SPRUNG, id="spring")],
)
def test_no_effect_takes_the_place_of_a_sign(frame):
    checks = check_log(frame.assign(tau3=-frame["tau3"]), ROBOT).checks
    (told,) = [s for s in checks if s.certainty != "noted"]
    assert told.check == "reading" and told.certainty == "certain"
    assert told.remedy.option == "--flip tau3"
    assert "another cause" not in told.suspicion


@pytest.mark.slow
def test_what_an_effect_explains_far_better_is_not_told(arm, short):
    """A spring between the joints looks like another sign of the first."""
    assert readings(SPRUNG) == []
    pull = 2.0 * (short["q1"] - short["q2"])
    pulled = short.assign(tau1=short["tau1"] + pull, tau2=short["tau2"] - pull)
    assert readings(pulled, arm) == []


def test_a_joint_that_gives_way_under_its_weight_has_no_other_zero():
    options = {"magnitude": 2.5, "n_trajectories": 5, "duration": 5.0, "random_state": 40}
    frame = make_hidden_effect_log(ROBOT, "joint_elasticity", joints=[2], **options).frame
    assert [s for s in readings(frame) if s.certainty != "noted"] == []


def test_one_of_two_is_a_note():
    """Six seconds do not show whether a sign is wrong or a second spring acts."""
    frame = log_of("spring", [3], n_trajectories=2, duration=3.0, random_state=5)
    (told,) = readings(frame.assign(tau4=-frame["tau4"]))
    assert told.certainty == "noted" and told.remedy is None
    assert "--flip tau4" in told.evidence
    assert told.suspicion.startswith("either the torque of joint 4")
    assert told.suspicion.endswith("or there is another cause: coupling spring")
