# SPDX-License-Identifier: BSD-3-Clause
"""Derivatives of smoothed positions."""

import numpy as np

from skidyn.effects import Signals
from skidyn.evidence import smooth_motion

TIME = np.arange(0, 10, 0.01)


def motion(time=TIME, noise=0.0):
    q = np.sin(3 * time)[:, None] + noise * np.random.default_rng(0).normal(size=(len(time), 1))
    nothing = np.zeros_like(q)
    return Signals(q, nothing, nothing, np.zeros(len(time), dtype=int), time=time)


def test_velocity_and_acceleration_of_a_sine():
    smoothed = smooth_motion(motion())
    use = smoothed.usable[:, 0]
    assert use.mean() > 0.9 and not use[0] and not use[-1]
    np.testing.assert_allclose(smoothed.dq[use, 0], 3 * np.cos(3 * TIME[use]), atol=1e-6)
    np.testing.assert_allclose(smoothed.ddq[use, 0], -9 * np.sin(3 * TIME[use]), atol=1e-3)


def test_uneven_steps_are_as_good():
    steps = np.random.default_rng(1).uniform(0.008, 0.012, 1000)
    time = np.cumsum(steps)
    smoothed = smooth_motion(motion(time))
    use = smoothed.usable[:, 0]
    np.testing.assert_allclose(smoothed.dq[use, 0], 3 * np.cos(3 * time[use]), atol=1e-4)


def test_noise_is_lowered_and_rates_are_medians():
    noisy = motion(noise=1e-3)
    use = smooth_motion(noisy).usable[:, 0]
    left = smooth_motion(noisy).q[use, 0] - np.sin(3 * TIME[use])
    assert left.std() < 0.8e-3
    assert np.isclose(noisy.rate, 100.0) and noisy.usable.all()
