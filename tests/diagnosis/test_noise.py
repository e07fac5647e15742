# SPDX-License-Identifier: BSD-3-Clause
"""Noise of the torque sensor from what changes faster than any motion."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


def test_it_is_that_of_the_simulated_sensor(spring_log, missing):
    ratio = missing.sensor_noise / spring_log.noise_std
    assert (ratio > 0.8).all() and (ratio < 1.05).all()  # a lower bound


def test_a_missing_effect_does_not_raise_it(spring_log, missing, complete_log, complete):
    # the simulated noise is a share of the torque of each log
    with_effect = missing.sensor_noise / spring_log.noise_std
    without = complete.sensor_noise / complete_log.noise_std
    np.testing.assert_allclose(with_effect, without, rtol=0.1)


def test_it_contains_the_rounding_of_a_coarse_torque():
    """From sample to sample such a torque hardly changes."""
    robot = load_planar_arm()
    log = make_hidden_effect_log(robot, None, noise="low", random_state=5)
    step = np.array([0.25, 0.3]) * log.y.std(axis=0)
    found = diagnose(RBDRegressor(robot), log.X, np.round(log.y / step) * step)
    np.testing.assert_allclose(found.sensor_noise, step / np.sqrt(12), rtol=0.3)
    assert found.verdict == "complete" and not np.any(found.remainder > 2 * found.sensor_noise)


@pytest.mark.parametrize("cutoff", [10.0, 20.0])
def test_noise_that_passed_a_low_pass_filter_is_noise(complete_log, cutoff):
    log, torque = complete_log, np.array(complete_log.y)
    sos = butter(4, cutoff, fs=100.0, output="sos")
    for number in np.unique(log.X["trajectory"]):
        own = (log.X["trajectory"] == number).to_numpy()
        torque[own] = sosfiltfilt(sos, torque[own], axis=0)
    passed = log.noise_std * np.sqrt(cutoff / 50.0)

    found = diagnose(RBDRegressor(log.robot), log.X, torque)

    assert found.verdict == "complete"
    assert np.all(np.abs(np.log(found.sensor_noise / passed)) < np.log(4.0))


def test_a_loud_recording_has_no_intermittent_torque():
    """Its noise, and not that of all, is what a torque that comes and goes has to exceed."""
    log = make_hidden_effect_log(
        load_planar_arm(), None, n_trajectories=6, duration=6.0, random_state=3
    )
    loud = (log.X["trajectory"] == log.X["trajectory"].iloc[-1]).to_numpy()
    torque = np.array(log.y)
    noise = np.random.default_rng(0).normal(size=int(loud.sum()))
    torque[loud, 1] += 0.15 * np.std(log.y[:, 1]) * noise

    found = diagnose(RBDRegressor(log.robot, ("viscous", "coulomb")), log.X, torque, checks=())

    assert found.verdict == "complete"
