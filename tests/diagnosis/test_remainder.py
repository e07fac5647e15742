# SPDX-License-Identifier: BSD-3-Clause
"""What is left and nothing that was logged predicts is told where it is slow, as noise is not."""

import numpy as np
import pytest
from scipy.signal import lfilter

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(
        load_planar_arm(), None, noise="high", duration=6.0, random_state=4
    )


@pytest.fixture(scope="module")
def wandering(log):
    """A torque that wanders by chance, over about half a second."""
    steps = np.random.default_rng(1).normal(size=len(log.y))
    torque = lfilter([1.0], [1.0, -0.98], steps)
    return torque / torque.std()


def test_slow_remainder_below_twice_the_noise_is_told(log, wandering):
    clean = diagnose(RBDRegressor(log.robot), log.X, log.y)
    torque = log.y.copy()
    torque[:, 1] += 1.4 * clean.noise[1] * wandering

    found = diagnose(RBDRegressor(log.robot), log.X, torque)

    assert clean.verdict == "complete"
    assert found.rmse_after[1] < 2 * found.noise[1]
    assert found.verdict == "unknown"
    assert found.unexplained["joints"] == [2]
    assert found.unexplained["variables"] == []


def test_slow_remainder_of_a_thousandth_of_the_range_is_not_told(log, wandering):
    torque = log.y.copy()
    torque[:, 1] += 0.001 * np.ptp(log.y[:, 1]) * wandering

    assert diagnose(RBDRegressor(log.robot), log.X, torque).verdict == "complete"
