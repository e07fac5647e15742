# SPDX-License-Identifier: BSD-3-Clause
"""Torques in other units, and at other scales than those of the other joints."""

from dataclasses import replace

import pytest

from skidyn.datasets import (
    load_planar_arm,
    load_scara,
    load_ur5,
    make_hidden_effect_log,
)
from skidyn.logs import check_log


def test_torque_in_newton_millimetres(signals, torque, found, only):
    only(found(signals, 1e3 * torque), "torque_scale", "certain", "--units tau=Nmm")


def test_another_scale_of_each_joint_is_not_a_unit(signals, torque, found):
    told = {s.check: s for s in found(signals, torque * [40.0, 110.0])}["torque_scale"]
    assert told.certainty == "suspected" and "motor currents" in told.suspicion


def test_currents(signals, torque, found):
    told = [s for s in found(signals, torque * 0.05) if s.check == "torque_scale"]
    assert told and "motor currents" in told[0].suspicion


@pytest.mark.parametrize("factor", [0.25, 4.0])
def test_the_torque_of_one_joint_at_another_scale(factor, recorded, told_of):
    told = told_of(recorded.frame.assign(tau2=factor * recorded.frame["tau2"]))["torque_scale"]
    name, _, size = told.remedy.option.partition("=")
    assert told.joints == (2,) and name == "--gain tau2"
    assert float(size) == pytest.approx(1 / factor, rel=0.1)


def test_a_torque_far_beyond_the_effort_limit(arm, recorded, told_of):
    robot = replace(arm, effort_limits=2 * recorded.frame[["tau1", "tau2"]].abs().max().to_numpy())
    assert "torque_scale" not in told_of(recorded.frame, robot)
    told = told_of(recorded.frame.assign(tau2=1e3 * recorded.frame["tau2"]), robot)["torque_scale"]
    assert told.joints == (2,) and told.remedy.option == "--gain tau2=0.001"


def test_an_effort_limit_that_the_weight_of_the_links_exceeds_is_what_is_wrong(
    arm, recorded, told_of
):
    largest = recorded.frame[["tau1", "tau2"]].abs().max().to_numpy()
    robot = replace(arm, effort_limits=largest * [0.02, 2])
    assert "torque_scale" not in told_of(recorded.frame, robot)


@pytest.mark.slow
def test_a_unit_beside_an_effect_as_large_as_the_torque_of_the_bodies():
    robot = load_scara()
    log = make_hidden_effect_log(
        robot, "torque_ripple", n_trajectories=5, duration=6.0, magnitude=4.0, random_state=2
    )
    torque = {f"tau{k + 1}": 1e3 * log.frame[f"tau{k + 1}"] for k in range(4)}
    told = {s.check: s for s in check_log(log.frame.assign(**torque), robot).checks}
    assert told["torque_scale"].remedy.option == "--units tau=Nmm"
    assert "torque_scale" not in {s.check for s in check_log(log.frame, robot).checks}


@pytest.fixture(scope="module")
def wrist():
    robot = load_ur5()
    return robot, make_hidden_effect_log(
        robot, "stribeck", n_trajectories=5, duration=5.0, random_state=7
    ).frame


@pytest.mark.slow
def test_a_last_joint_with_friction_alone_is_in_the_unit_of_the_one_before(wrist):
    robot, frame = wrist
    both = frame.assign(**{n: 1e3 * frame[n] for n in ("tau5", "tau6")})
    (told,) = [s for s in check_log(both, robot).checks if s.certainty != "noted"]
    assert told.joints == (5, 6) and told.remedy.option == "--gain tau5=0.001,tau6=0.001"
    alone = check_log(frame.assign(tau6=1e3 * frame["tau6"]), robot).checks
    (told,) = [s for s in alone if s.check == "torque_scale"]
    assert told.certainty == "noted" and told.joints == (6,)


def test_a_spring_is_no_other_scale():
    robot = load_planar_arm().with_gravity((0, 0, -9.81))
    log = make_hidden_effect_log(robot, None, n_trajectories=6, duration=6.0, random_state=4)
    log.frame["tau2"] += 8.0 * log.frame["q2"]
    assert "torque_scale" not in {told.check for told in check_log(log.frame, robot).checks}
