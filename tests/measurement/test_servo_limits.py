# SPDX-License-Identifier: BSD-3-Clause
"""Gain and limit of a servo follow from the torque that its motion takes."""

import numpy as np
import pytest

from skidyn.measurement import Measurement, servo_settings
from skidyn.simulation import servo_torque


@pytest.fixture(scope="module")
def seen(signals_of):
    """Settings by kind, joint and values; each value is within its interval."""

    def found(servo, of_servos=True):
        robot, torque = servo.robot, servo_torque(servo.controller, servo.log)
        signals = signals_of(servo.log, robot)
        measured = Measurement(signals, torque, robot, robot.joint_names, of_servos=of_servos)
        settings = servo_settings(measured, np.array([200.0, 12.0]))
        for setting in settings:
            assert all(low < value < high for value, low, high in setting.parameters.values())
        return [(s.kind, s.joint, s.parameters, s.evidence) for s in settings]

    return found


def test_a_servo_within_its_limits_has_neither(servo_log, seen):
    assert seen(servo_log({})) == []


def test_a_torque_that_was_measured_is_of_no_servo(servo_log, seen):
    assert seen(servo_log({}, limit=(100.0, 0.5)), of_servos=False) == []


def test_size_and_fall_of_a_limit_are_found(servo_log, seen):
    ((kind, joint, values, evidence),) = seen(servo_log({}, limit=(100.0, 0.5)))
    assert (kind, joint, list(values)) == ("servo_current", 1, ["limit"])
    value, low, high = values["limit"]
    assert value == pytest.approx(0.5, rel=0.03) and low < 0.5 < high
    assert "it removes 100 % of the squared error" in evidence
    slow = servo_log({}, limit=(100.0, 0.8), no_load_speed=(np.inf, 2.0))
    ((kind, joint, values, _),) = seen(slow)
    assert (kind, joint, list(values)) == ("servo_voltage", 1, ["limit", "no_load_speed"])
    for (value, low, high), true in zip(values.values(), (0.8, 2.0), strict=True):
        assert value == pytest.approx(true, rel=0.1) and low < true < high


def test_a_gain_is_what_the_stated_bodies_say(servo_log, seen):
    ((kind, joint, values, _),) = seen(servo_log({}, stiffness=(200.0, 8.0)))
    assert (kind, joint) == ("servo_gain", 1)
    assert values["stiffness"][0] == pytest.approx(8.0, rel=0.02)
