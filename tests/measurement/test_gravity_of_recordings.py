# SPDX-License-Identifier: BSD-3-Clause
"""Torque that contains gravity in some recordings only."""

import pytest

from skidyn.datasets import load_scara, load_ur5, make_hidden_effect_log
from skidyn.logs import check_log

OPTIONS = {"n_trajectories": 6, "duration": 5.0, "random_state": 1}


def told_of(frame, robot):
    return {told.check: told for told in check_log(frame, robot).checks}


@pytest.mark.parametrize("kind", [None, pytest.param("payload", marks=pytest.mark.slow)])
def test_gravity_that_is_removed_from_a_recording_on(kind):
    robot = load_ur5()
    frame = make_hidden_effect_log(robot, kind, **OPTIONS).frame
    later = frame["trajectory"] > 4
    names = [f"{symbol}{k + 1}" for symbol in ("tau", "q") for k in range(6)]
    frame.loc[later, names[:6]] -= 1.05 * robot.gravity_torque(
        frame.loc[later, names[6:]].to_numpy()
    )

    told = told_of(frame, robot)["gravity_of_recordings"]

    assert told.certainty == "suspected"
    assert "no gravity in trajectories 5 and 6" in told.suspicion


@pytest.mark.parametrize(
    "kind", ["payload", pytest.param("external_wrench", marks=pytest.mark.slow)]
)
def test_loads_of_some_recordings_are_no_missing_gravity(kind):
    log = make_hidden_effect_log(load_ur5(), kind, **OPTIONS)
    assert "gravity_of_recordings" not in told_of(log.frame, log.robot)


def test_constant_gravity_of_a_vertical_slide_tells_nothing():
    log = make_hidden_effect_log(load_scara(), None, **OPTIONS)
    assert "gravity_of_recordings" not in told_of(log.frame, log.robot)
