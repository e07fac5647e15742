# SPDX-License-Identifier: BSD-3-Clause
"""Noise of simulated sensors."""

import numpy as np

from skidyn.datasets import load_planar_arm, load_scara, make_hidden_effect_log

PLANAR, SCARA = load_planar_arm(), load_scara()
SHORT = {"n_trajectories": 4, "duration": 4.0}


def test_noise_has_the_stated_size_and_colour():
    noisy = make_hidden_effect_log(PLANAR, None, noise="high", **SHORT)
    clean = make_hidden_effect_log(PLANAR, None, noise=0.0, **SHORT)
    noise = (noisy.y - clean.y).reshape(4, 400, 2)
    np.testing.assert_allclose(noise.std(axis=(0, 1)), noisy.noise_std, rtol=0.15)
    lag_one = np.mean(noise[:, 1:] * noise[:, :-1], axis=(0, 1)) / noise.var(axis=(0, 1))
    assert np.all((lag_one > 0.15) & (lag_one < 0.5))
