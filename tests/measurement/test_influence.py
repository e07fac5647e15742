# SPDX-License-Identifier: BSD-3-Clause
"""Errors of the robot before and after a remedy."""

import numpy as np
import pytest

from skidyn.measurement import Measurement, errors_of_fits


@pytest.fixture
def errors(arm, signals):
    def of(torque, motion=signals, robot=arm):
        return errors_of_fits(Measurement(motion, torque, robot, ("shoulder", "elbow")))

    return of


def test_noise_alone_is_left_of_a_right_log(errors, torque):
    assert np.all(errors(torque) < 0.05)


def test_a_scale_is_an_error_of_the_stated_bodies_only(errors, torque):
    stated, identified = errors(5.0 * torque)
    assert stated > 0.3 and identified < 0.05


def test_a_sign_is_an_error_of_both(errors, torque, signals):
    turned = signals.with_(dq=signals.dq * [-1.0, 1.0], ddq=signals.ddq * [-1.0, 1.0])
    turned = turned.with_(q=signals.q * [-1.0, 1.0])
    assert np.all(errors(torque, turned) > 4 * errors(torque))


def test_nothing_can_be_fitted_without_a_robot(errors, torque):
    assert errors(torque, robot=None) is None
