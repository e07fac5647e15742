# SPDX-License-Identifier: BSD-3-Clause
"""Servos that are not as stated are told by the torque that their motion takes."""

import re

import numpy as np
import pytest

from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.simulation import Controller

FRICTION = ("viscous", "coulomb", "rotor_inertia")
CHECKS = {"servo_gain", "servo_current", "servo_voltage"}


def told(servo, controller=None):
    """What the checks say of the servos, and the diagnosis."""
    found = diagnose(
        RBDRegressor(servo.robot, FRICTION),
        servo.log,
        controller=controller or servo.controller,
        effects=["stribeck"],
    )
    return [s for s in found.checks if s.check in CHECKS], found


def number(pattern, text):
    return float(re.search(pattern, text)[1])


def test_a_servo_as_stated_is_not_doubted(servo_log, sticky_servo):
    assert told(servo_log({}))[0] == [] and told(sticky_servo)[0] == []


def test_a_limit_of_the_current_is_told_with_its_size_and_the_remedy_takes_it_off(servo_log):
    weak = servo_log({}, limit=(100.0, 0.5))
    (doubt,), found = told(weak)
    assert (doubt.check, doubt.joints) == ("servo_current", (2,))
    limit = number(r"limit=([\d.]+)", doubt.remedy.code)
    assert limit == pytest.approx(0.5, rel=0.03)
    assert {f.kind for f in found.findings} <= {"unknown"}
    assert [f for f in found.explain_servo_motion() if f.joint == 2] == []
    stated = Controller((200.0, 12.0), (12.0, 0.6), (100.0, limit), follows_velocity=False)
    assert told(weak, stated)[0] == []


def test_a_voltage_is_told_from_a_current(servo_log):
    slow = servo_log({}, limit=(100.0, 0.8), no_load_speed=(np.inf, 2.0))
    (doubt,), _ = told(slow)
    assert (doubt.check, doubt.joints) == ("servo_voltage", (2,))
    assert number(r"limit=([\d.]+)", doubt.remedy.code) == pytest.approx(0.8, rel=0.1)
    assert number(r"no_load_speed=([\d.]+)", doubt.remedy.code) == pytest.approx(2.0, rel=0.1)


def test_a_gain_is_told_where_the_other_joint_is_as_stated(servo_log):
    softer = servo_log({}, stiffness=(200.0, 8.0))
    (doubt,), _ = told(softer)
    assert (doubt.check, doubt.joints) == ("servo_gain", (2,))
    assert number(r"times ([\d.]+) of", doubt.suspicion) == pytest.approx(8 / 12, rel=0.05)
    both = servo_log({}, stiffness=(130.0, 8.0))  # the bodies of the description may be wrong
    assert told(both)[0] == []


def test_a_torque_that_was_measured_has_no_servo(servo_log):
    weak = servo_log({}, limit=(100.0, 0.5))
    torque = weak.controller.torque(
        *(weak.log[[f"{s}{j}" for j in (1, 2)]].to_numpy() for s in ("q", "dq", "q_ref")),
        np.zeros((len(weak.log), 2)),
    )
    found = diagnose(RBDRegressor(weak.robot, FRICTION), weak.log, torque, effects=["stribeck"])
    assert not CHECKS & {s.check for s in found.checks}
