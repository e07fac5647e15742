# SPDX-License-Identifier: BSD-3-Clause
"""What was found and is not listed."""

import warnings

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


@pytest.mark.parametrize(
    ("delay", "is_named"),
    [
        (-0.003, False),
        *(pytest.param(*c, marks=pytest.mark.slow) for c in [(0.003, False), (0.012, True)]),
    ],
)
def test_a_delay_within_half_a_sampling_step_is_a_remark_and_no_finding(delay, is_named):
    """Loggers read the channels of a row one after the other."""
    log = make_hidden_effect_log(load_planar_arm(), None, noise="low", rate=100.0, random_state=1)
    torque = log.y.copy()
    for name in np.unique(log.X["trajectory"]):
        rows = np.flatnonzero(log.X["trajectory"] == name)
        clock = log.X["time"].to_numpy()[rows]
        for joint in range(2):
            torque[rows, joint] = np.interp(clock - delay, clock, log.y[rows, joint])

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        diagnosis = diagnose(RBDRegressor(log.robot), log.X, torque)

    assert [f.kind for f in diagnosis.findings] == ["time_delay"] * is_named
    assert any("half of the sampling step" in note for note in diagnosis.warnings) != is_named
    assert diagnosis.verdict == ("missing" if is_named else "complete")


@pytest.mark.parametrize(("share", "is_named"), [(0.5, False), (3.0, True)])
def test_hum_that_is_smaller_than_the_noise_is_a_remark_and_no_finding(share, is_named):
    log = make_hidden_effect_log(load_planar_arm(), None, noise="high", random_state=4)
    noise = diagnose(RBDRegressor(log.robot), log.X, log.y, effects=[], checks=()).noise
    hum = np.sqrt(2) * share * np.sin(2 * np.pi * 23.0 * log.X["time"].to_numpy())

    diagnosis = diagnose(RBDRegressor(log.robot), log.X, log.y + hum[:, None] * noise, checks=())

    assert {f.variables for f in diagnosis.findings} == ({("time",)} if is_named else set())
    assert any("wave of 23 Hz" in note for note in diagnosis.warnings) != is_named
    assert diagnosis.verdict == ("unknown" if is_named else "complete")


def test_an_effect_beneath_fast_noise_is_judged_by_averaged_torque():
    log = {
        kind: make_hidden_effect_log(
            load_planar_arm(),
            kind,
            joints=[1],
            n_trajectories=8,
            duration=10.0,
            rate=500.0,
            random_state=3,
        )
        for kind in ("torque_ripple", None)
    }
    torque = np.array(log["torque_ripple"].y)
    size = np.std(torque[:, 0] - log[None].y[:, 0])
    torque[:, 0] += 14 * size * np.random.default_rng(0).normal(size=len(torque))

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        diagnosis = diagnose(RBDRegressor(log[None].robot), log[None].X, torque)

    (finding,) = diagnosis.findings
    assert (finding.kind, finding.joints) == ("torque_ripple", (1,))
    assert finding.error_drop < 0.005
    assert finding.averaged_drop == pytest.approx(0.12, abs=0.02)
    assert "averaged over windows" in finding.sentence
    assert finding.to_dict()["averaged_drop"] == finding.averaged_drop


@pytest.mark.slow
def test_what_was_significant_beside_a_withdrawn_function_only_is_not_named(arm_log, found_in):
    """A function of the noisy accelerations of coarse encoders does not predict samples better."""
    X, torque, step = arm_log.X.copy(), np.array(arm_log.y), 2 * np.pi / 2**12
    drum = X["ddq1"] * X["q1"] ** 2
    torque[:, 0] += 0.4 * np.std(torque[:, 0]) * drum / np.std(drum)
    for name in ("q1", "q2"):
        X[name] = np.round(X[name] / step) * step

    assert set(found_in(load_planar_arm(), X, torque)) == {"unknown"}
