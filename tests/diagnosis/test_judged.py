# SPDX-License-Identifier: BSD-3-Clause
"""Errors after each finding, and findings that are worth their terms."""

import numpy as np

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


def test_a_ripple_of_the_given_model_is_part_of_it():
    log = make_hidden_effect_log(
        load_planar_arm(), "torque_ripple", joints=[1], n_trajectories=8, duration=6.0, rate=200.0
    )
    first = diagnose(RBDRegressor(log.robot), log.X, log.y, checks=())
    again = diagnose(first.model, log.X, log.y, checks=())

    assert [f.kind for f in first.findings] == ["torque_ripple"]
    assert (again.verdict, again.findings) == ("complete", [])
    np.testing.assert_allclose(again.rmse_before, first.rmse_after, rtol=0.1)


def test_each_of_two_ripples_removes_its_own_part():
    """A second harmonic is found after the first one: only both together reach the noise."""
    log = make_hidden_effect_log(
        load_planar_arm(), None, n_trajectories=8, duration=6.0, rate=200.0, noise="low"
    )
    torque, q, amplitude = np.array(log.y), log.X["q1"].to_numpy(), 0.3 * np.std(log.y, axis=0)
    torque[:, 0] += amplitude[0] * (np.sin(60 * q) + 0.5 * np.sin(97 * q))
    diagnosis = diagnose(RBDRegressor(log.robot), log.X, torque, checks=())

    assert {f.kind for f in diagnosis.findings} == {"torque_ripple"}
    waves = sorted(t.shape["N"] for f in diagnosis.findings for t in f.terms)
    np.testing.assert_allclose(waves, [60, 97], rtol=0.02)
    assert diagnosis.verdict == "missing"
    assert diagnosis.rmse_after[0] < 0.2 * diagnosis.rmse_before[0]
