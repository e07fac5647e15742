# SPDX-License-Identifier: BSD-3-Clause
"""Links that swing already when a recording begins."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


@pytest.mark.slow
@pytest.mark.parametrize("swing", [0.0, 0.25])  # N m
def test_elasticity_is_found_beside_a_swing_from_before_the_recording(swing):
    log = make_hidden_effect_log(
        load_planar_arm(),
        "joint_elasticity",
        joints=[2],
        noise="low",
        n_trajectories=8,
        duration=8.0,
        random_state=3,
    )
    times = log.X.groupby("trajectory")["time"]
    since = (log.X["time"] - times.transform("min")).to_numpy()
    omega = 2 * np.pi * 4.0
    phase = omega * since + log.X["trajectory"].to_numpy()
    torque = log.y.copy()
    torque[:, 1] += swing * np.exp(-0.03 * omega * since) * np.cos(phase)

    found = diagnose(RBDRegressor(log.robot), log.X, torque, checks=())

    assert [(f.kind, f.joints) for f in found.findings] == [("joint_elasticity", (2,))]
    size = found.findings[0].parameters["K"]
    assert size["low"] < log.parameters["K"][0] < size["high"]
    told = [note for note in found.warnings if "when a recording begins" in note]
    assert len(told) == (swing > 0)
    assert all("joint 2 swings" in note for note in told)
