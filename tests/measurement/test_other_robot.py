# SPDX-License-Identifier: BSD-3-Clause
"""The description of another robot."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_srs_arm, load_ur5, make_hidden_effect_log
from skidyn.logs import check_log
from skidyn.measurement import names_in_doubt


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(
        load_ur5(), None, n_trajectories=5, duration=6.0, random_state=4
    ).frame


def test_links_of_other_proportions_and_masses_are_suspected_as_a_whole(log):
    robot = load_ur5()
    translations = robot.tree.translations.copy()
    translations[2] *= 0.4
    translations[3] *= 2.4
    mass = np.array([1.0, 0.5, 2.0, 0.3, 3.0, 1.0])[:, None]
    other = replace(
        robot,
        tree=replace(robot.tree, translations=translations),
        inertial_parameters=mass * np.asarray(robot.inertial_parameters),
    )
    checks = list(check_log(log, other).checks)
    (told,) = [s for s in checks if s.check == "other_robot"]
    assert told.certainty == "suspected" and len(told.joints) > 1
    assert "the description is not of this robot" in names_in_doubt(checks)


def test_a_zero_in_the_description_of_another_robot_is_one_of_two_causes():
    options = {"n_trajectories": 5, "duration": 6.0, "random_state": 4}
    log = make_hidden_effect_log(load_panda(), None, **options).frame
    told = [s for s in check_log(log, load_srs_arm()).checks if "the zero of" in s.suspicion]
    assert told and "or the description is not of this robot" in told[0].suspicion
    assert told[0].remedy is None


def test_masses_that_are_off_by_a_fifth_are_of_the_same_robot(log):
    robot = load_ur5()
    off = np.array([1.2, 0.8, 1.2, 0.8, 1.2, 0.8])[:, None]
    wrong = replace(robot, inertial_parameters=off * np.asarray(robot.inertial_parameters))
    assert "other_robot" not in {s.check for s in check_log(log, wrong).checks}
