# SPDX-License-Identifier: BSD-3-Clause
"""Noise of the torque sensor from what changes faster than any motion."""

import numpy as np


def test_it_is_that_of_the_simulated_sensor(spring_log, missing):
    ratio = missing.sensor_noise / spring_log.noise_std
    assert (ratio > 0.8).all() and (ratio < 1.05).all()  # a lower bound


def test_a_missing_effect_does_not_raise_it(missing, spring_log, complete, complete_log):
    # the logs have other motions, and sensors whose noise is a share of their torque
    with_spring = missing.sensor_noise / spring_log.noise_std
    without = complete.sensor_noise / complete_log.noise_std
    np.testing.assert_allclose(with_spring, without, rtol=0.3)
