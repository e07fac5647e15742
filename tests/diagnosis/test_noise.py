# SPDX-License-Identifier: BSD-3-Clause
"""Noise of the torque sensor from what changes faster than any motion."""

import numpy as np


def test_it_is_that_of_the_simulated_sensor(spring_log, missing):
    ratio = missing.sensor_noise / spring_log.noise_std
    assert (ratio > 0.8).all() and (ratio < 1.05).all()  # a lower bound


def test_a_missing_effect_does_not_raise_it(spring_log, missing, complete_log, complete):
    # the simulated noise is a share of the torque of each log
    with_effect = missing.sensor_noise / spring_log.noise_std
    without = complete.sensor_noise / complete_log.noise_std
    np.testing.assert_allclose(with_effect, without, rtol=0.1)
