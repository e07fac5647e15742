# SPDX-License-Identifier: BSD-3-Clause
"""What the motion of servos lacks is named from commands and positions."""

import pytest

from skidyn.diagnosis import diagnose
from skidyn.effects import Term
from skidyn.exceptions import LogError, SkidynError
from skidyn.identification import RBDRegressor
from skidyn.simulation import Controller, explain_servo_motion, servo_torque

FRICTION = ("viscous", "coulomb")


@pytest.fixture(scope="module")
def diagnosis(sticky_servo):
    """The motion explained for a diagnosis that has tried one effect."""
    found = diagnose(
        RBDRegressor(sticky_servo.robot, FRICTION),
        sticky_servo.log,
        servo_torque(sticky_servo.controller, sticky_servo.log),
        effects=["spring"],
        checks=(),
    )
    assert found.servo_motion is None and found.to_dict()["servo_motion"] is None
    found.explain_servo_motion(sticky_servo.controller)
    return found


def fitted(servo):
    return RBDRegressor(servo.robot, FRICTION).fit(
        servo.log, servo_torque(servo.controller, servo.log)
    )


@pytest.mark.slow
def test_stiction_is_named_on_its_joint_with_its_size(diagnosis):
    (found,) = diagnosis.servo_motion
    assert (found.kind, found.joint) == ("stribeck", 2)
    assert found.parameters["dF"] == pytest.approx(0.15, rel=0.4)
    assert found.parameters["vs"] == pytest.approx(0.1, rel=0.4)
    assert found.after < 0.6 * found.before
    assert str(found).startswith("Stribeck friction of joint 2 (dF = 0.1")


def test_nothing_is_named_where_friction_is_all(servo_log):
    smooth = servo_log({})
    assert explain_servo_motion(fitted(smooth), smooth.log, smooth.controller) == []


@pytest.mark.slow
def test_nothing_is_named_where_the_gain_is_wrong(sticky_servo):
    wrong = Controller((200.0, 0.3 * 12.0), (12.0, 0.6), follows_velocity=False)
    assert explain_servo_motion(fitted(sticky_servo), sticky_servo.log, wrong, joints=[2]) == []


@pytest.mark.slow
def test_a_diagnosis_keeps_what_the_motion_names(diagnosis):
    (found,) = diagnosis.servo_motion
    assert diagnosis.to_dict()["servo_motion"] == [found.to_dict()]
    assert diagnosis.verdict != "complete"


def test_a_joint_that_the_robot_lacks_and_a_short_log_are_refused(sticky_servo):
    model, log, servo = fitted(sticky_servo), sticky_servo.log, sticky_servo.controller
    with pytest.raises(SkidynError, match=r"joints=\[3\]; the robot has joints 1 to 2"):
        explain_servo_motion(model, log, servo, joints=[3])
    with pytest.raises(LogError, match="holds 1 piece"):
        explain_servo_motion(model, log[log["trajectory"] == 1], servo)


@pytest.mark.slow
def test_effects_of_two_joints_are_named_one_after_the_other(servo_log):
    shapes = {"vs": 0.1, "delta": 2.0}
    sticky = servo_log({Term("stribeck", (1,), shapes): 2.0, Term("stribeck", (2,), shapes): 0.15})
    found = explain_servo_motion(fitted(sticky), sticky.log, sticky.controller)
    assert sorted((f.kind, f.joint) for f in found) == [("stribeck", 1), ("stribeck", 2)]


@pytest.mark.slow
def test_what_is_known_is_not_named_again(sticky_servo):
    model, log, servo = fitted(sticky_servo), sticky_servo.log, sticky_servo.controller
    assert explain_servo_motion(model, log, servo, known=[("stribeck", 2)]) == []
