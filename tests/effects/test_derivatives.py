# SPDX-License-Identifier: BSD-3-Clause
"""Derivatives of torques that were computed from measured motion."""

import numpy as np

from skidyn.effects import get_effect


def delayed(signals):
    return get_effect("time_delay").torque_columns(signals, (0,))[0][:, 0]


def test_a_late_torque_changes_by_its_rate(signals):
    """Two recordings of three seconds: at their ends there are fewer neighbours."""
    expected = -3 * np.cos(3 * signals.time)
    error = np.abs(delayed(signals) - expected)
    assert error.max() < 0.5
    for start in (0, 300):
        assert error[start + 5 : start + 295].max() < 0.02


def test_noise_is_smoothed_and_no_recording_feels_another(signals):
    noise = 1e-3 * np.random.default_rng(0).normal(size=signals.model_torque.shape)
    torque = signals.model_torque + noise
    column = delayed(signals.with_(model_torque=torque))
    plain = np.gradient(torque[:, 0], signals.time)
    expected = 3 * np.cos(3 * signals.time)
    assert np.std(-column - expected) < 0.5 * np.std(plain - expected)
    torque[300:] += 100.0
    np.testing.assert_array_equal(delayed(signals.with_(model_torque=torque))[:300], column[:300])
