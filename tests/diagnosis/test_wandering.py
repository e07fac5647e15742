# SPDX-License-Identifier: BSD-3-Clause
"""A torque that wanders slowly in time is told as one of time, which no logged signal predicts."""

import numpy as np

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


def wandering(fastest):
    """A log whose second torque wanders at frequencies up to some, Hz."""
    log = make_hidden_effect_log(
        load_planar_arm(), None, noise="low", n_trajectories=3, duration=40.0, random_state=5
    )
    torque, time = np.array(log.y), log.X["time"].to_numpy()
    rng = np.random.default_rng(1)
    wander = np.zeros(len(time))
    for name in log.X["trajectory"].unique():
        own = (log.X["trajectory"] == name).to_numpy()
        for frequency in rng.uniform(0.2 * fastest, fastest, 8):
            phase = 2 * np.pi * frequency * time[own] + rng.uniform(0, 2 * np.pi)
            wander[own] += rng.normal() * np.sin(phase)
    torque[:, 1] += 5 * log.noise_std[1] * wander / wander.std()
    return diagnose(RBDRegressor(log.robot), log.X, torque)


def test_a_drifting_zero_is_a_torque_of_time():
    diagnosis = wandering(0.05)
    (finding,) = diagnosis.findings
    assert diagnosis.verdict == "unknown"
    assert (finding.kind, finding.joints, finding.variables) == ("unknown", (2,), ("time",))
    assert finding.error_drop > 0.8 and "wanders slowly" in finding.sentence


def test_what_changes_as_fast_as_the_motion_is_not_told_as_one_of_time():
    assert not any("wanders" in f.title for f in wandering(1.0).findings)
