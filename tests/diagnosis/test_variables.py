# SPDX-License-Identifier: BSD-3-Clause
"""The signals that a nameless torque depends on, by test."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


def test_the_signals_are_those_the_torque_depends_on(nameless):
    log, diagnosis = nameless.log, nameless.diagnosis

    assert diagnosis.verdict == "unknown"
    assert {j for f in diagnosis.findings for j in f.joints} == set(log.joints)
    for finding in diagnosis.findings:
        assert set(finding.variables) == nameless.variables
    for torque in diagnosis.unknowns:
        assert set(torque.variables) == nameless.variables
        for test in torque.tests:
            assert test.needed == (test.variable in torque.variables)
            assert test.p_value < 0.01 if test.needed else test.share < 0.05


@pytest.mark.slow
def test_a_temperature_of_the_recording_is_no_signal_of_its_torque():
    """In blocks of few recordings, a function of it would be one of the recording."""
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=6, duration=4.0)
    X, torque = log.X.copy(), log.y.copy()
    since = X["time"] - X.groupby("trajectory")["time"].transform("min")
    for joint in (1, 2):
        X[f"temp{joint}"] = 20.0 + 3.0 * ((X["trajectory"] * 5) % 7) + 0.1 * since
    one, other = ((X[name] - X[name].mean()) / X[name].std() for name in ("q1", "q2"))
    torque[:, 1] += 0.1 * np.ptp(torque[:, 1]) * one * other

    diagnosis = diagnose(RBDRegressor(log.robot), X, torque)

    assert [set(f.variables) for f in diagnosis.findings] == [{"q1", "q2"}]
    (unknown,) = diagnosis.unknowns
    assert "temp2" not in {test.variable for test in unknown.tests}
