# SPDX-License-Identifier: BSD-3-Clause
"""Gain and limit of a servo follow from the torque that its motion takes."""

import numpy as np
import pytest

from skidyn._signals import read_signals
from skidyn.measurement import Measurement
from skidyn.measurement._servo_limits import servos_seen
from skidyn.simulation import servo_torque


def seen(servo, of_servos=True):
    log, torque = servo.log, servo_torque(servo.controller, servo.log)
    signals, torque = read_signals(log, torque, servo.robot)
    return servos_seen(
        Measurement(signals, torque, servo.robot, ("one", "two"), of_servos=of_servos)
    )


def test_a_servo_within_its_limits_has_its_gain(servo_log):
    smooth = servo_log({})
    for servo in seen(smooth).values():
        assert not servo.is_limited and servo.gain == pytest.approx(1.0, abs=0.02)
        assert servo.error < 0.01 and servo.unexplained < 0.01
    assert seen(smooth, of_servos=False) == {}


def test_size_and_fall_of_a_limit_are_found(servo_log):
    weak = seen(servo_log({}, limit=(100.0, 0.5)))[1]
    assert weak.is_limited and not weak.falls and weak.limit == pytest.approx([0.5], rel=0.03)
    assert abs(weak.limit[0] - 0.5) < weak.half[0] and weak.left < 0.01
    slow = seen(servo_log({}, limit=(100.0, 0.8), no_load_speed=(np.inf, 2.0)))[1]
    assert slow.is_limited and slow.falls and slow.limit == pytest.approx([0.8, 2.0], rel=0.1)
    assert np.all(abs(slow.limit - [0.8, 2.0]) < slow.half)
    assert slow.gain == pytest.approx(1.0, abs=0.02)


def test_a_gain_is_what_the_stated_bodies_say(servo_log):
    softer = seen(servo_log({}, stiffness=(200.0, 8.0)))
    assert softer[1].gain == pytest.approx(12 / 8, rel=0.02)
    assert softer[0].gain == pytest.approx(1.0, abs=0.02)
