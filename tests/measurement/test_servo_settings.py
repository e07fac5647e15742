# SPDX-License-Identifier: BSD-3-Clause
"""What is said of a servo that is not as stated: size, interval, share of the error, chance."""

import numpy as np
import pytest

from skidyn.measurement import Measurement, servo_settings
from skidyn.simulation import servo_torque


@pytest.fixture
def settings(signals_of):
    def found(servo):
        robot, torque = servo.robot, servo_torque(servo.controller, servo.log)
        signals = signals_of(servo.log, robot)
        measurement = Measurement(signals, torque, robot, robot.joint_names, of_servos=True)
        return servo_settings(measurement, np.array([200.0, 12.0]))

    return found


def test_a_gain_has_its_size_and_a_chance(servo_log, settings):
    assert settings(servo_log({})) == []
    (found,) = settings(servo_log({}, stiffness=(200.0, 8.0)))
    value, low, high = found.parameters["stiffness"]
    assert (found.kind, found.joint) == ("servo_gain", 1)
    assert low < value < high and value == pytest.approx(8.0, rel=0.02)
    assert found.chance < 1e-6 and found.error_drop > 0.9


def test_a_limit_has_no_chance_but_the_error_that_it_removes(servo_log, settings):
    (found,) = settings(servo_log({}, limit=(100.0, 0.5)))
    value, low, high = found.parameters["limit"]
    assert (found.kind, found.joint, found.chance) == ("servo_current", 1, None)
    assert low < 0.5 < high and value == pytest.approx(0.5, rel=0.03)
    assert found.error_drop > 0.9 and "asks for more in" in found.evidence
