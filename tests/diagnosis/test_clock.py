# SPDX-License-Identifier: BSD-3-Clause
"""Waves in time of any frequency that the log resolves, of any form, are told by their clock."""

from __future__ import annotations

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(
        load_planar_arm(), None, noise="low", n_trajectories=6, duration=8.0, random_state=5
    )


@pytest.mark.parametrize(
    ("frequency", "square"),
    [
        (1.37, True),
        pytest.param(6.1, False, marks=pytest.mark.slow),
        (37.3, False),
        pytest.param(37.3, True, marks=pytest.mark.slow),
    ],
)
def test_a_wave_in_time_is_told_with_its_frequency(log, frequency, square):
    time = log.X["time"].to_numpy()
    wave = np.sin(2 * np.pi * frequency * time)
    torque = np.array(log.y)
    torque[:, 1] += 2 * log.noise_std[1] * (np.sign(wave) if square else np.sqrt(2) * wave)

    diagnosis = diagnose(RBDRegressor(log.robot), log.X, torque)

    assert diagnosis.verdict == "unknown"
    first = diagnosis.findings[0]
    assert (first.joints, first.variables) == ((2,), ("time",))
    np.testing.assert_allclose(first.terms[0].shape["frequency"], frequency, atol=0.01)
    # A square wave has harmonics that the log does not resolve.
    assert diagnosis.rmse_after[1] < (1.6 if square else 1.25) * log.noise_std[1]


def test_a_wave_is_told_in_samples_that_really_were_uneven():
    fine = make_hidden_effect_log(
        load_planar_arm(), None, rate=500.0, n_trajectories=6, duration=6.0, random_state=5
    )
    steps = np.random.default_rng(3).integers(1, 10, len(fine.X) // 5)
    rows = np.cumsum(steps)
    rows = rows[rows < len(fine.X)]
    X, torque = fine.X.iloc[rows].reset_index(drop=True), np.array(fine.y)[rows]
    torque[:, 1] += 3 * fine.noise_std[1] * np.sin(2 * np.pi * 21.7 * X["time"].to_numpy())

    diagnosis = diagnose(RBDRegressor(fine.robot), X, torque)

    assert diagnosis.findings[0].variables == ("time",)
    np.testing.assert_allclose(diagnosis.findings[0].terms[0].shape["frequency"], 21.7, atol=0.02)


@pytest.mark.parametrize("signal", ["q2", "dq2"])
def test_a_wave_that_begins_with_every_recording_is_told_with_its_signal(log, signal):
    X, torque = log.X, np.array(log.y)
    since = X["time"] - X.groupby("trajectory")["time"].transform("min")
    torque[:, 1] += 5 * log.noise_std[1] * X[signal] * np.sin(2 * np.pi * 0.73 * since + 0.4)

    (first,) = diagnose(RBDRegressor(log.robot), X, torque).findings

    assert (first.joints, set(first.variables)) == ((2,), {signal, "time"})
    np.testing.assert_allclose(first.terms[0].shape["frequency"], 0.73, atol=0.01)
