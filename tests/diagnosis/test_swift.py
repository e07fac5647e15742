# SPDX-License-Identifier: BSD-3-Clause
"""What is over within hundredths of a second is found in short windows."""

import warnings

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_scara, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


def diagnosis_of(robot, effect, **options):
    log = make_hidden_effect_log(robot, effect, **options)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return diagnose(RBDRegressor(robot), log.X, log.y, checks=())


@pytest.mark.slow
def test_a_play_is_not_told_as_elasticity_beside_it():
    diagnosis = diagnosis_of(
        load_planar_arm(),
        "backlash",
        joints=[2],
        n_trajectories=6,
        duration=6.0,
        rate=250.0,
        magnitude=0.3,
        random_state=3,
    )

    (finding,) = diagnosis.findings
    assert (finding.kind, finding.joints) == ("backlash", (2,))


@pytest.mark.slow
def test_noise_of_accelerations_in_short_windows_is_no_play():
    diagnosis = diagnosis_of(load_scara(), None, noise="low", rate=500.0, random_state=5002)

    assert diagnosis.verdict == "complete"


@pytest.mark.slow
def test_rounded_positions_are_no_play():
    robot = load_scara()
    log = make_hidden_effect_log(
        robot, None, rate=250.0, n_trajectories=6, duration=4.0, random_state=2
    )
    X = log.X.copy()
    for j, kind in enumerate(robot.joint_types):
        step = 2 * np.pi / 2**13 if kind != "prismatic" else 8e-5
        X[f"q{j + 1}"] = np.round(X[f"q{j + 1}"] / step) * step
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        diagnosis = diagnose(RBDRegressor(robot), X, log.y)

    assert diagnosis.verdict == "complete"


@pytest.mark.slow
def test_a_swing_too_small_for_long_windows_is_found_in_short_ones():
    diagnosis = diagnosis_of(
        load_planar_arm(),
        "joint_elasticity",
        joints=[1],
        rate=250.0,
        magnitude=0.05,
        random_state=3,
    )

    (finding,) = diagnosis.findings
    assert (finding.kind, finding.joints) == ("joint_elasticity", (1,))
    stiffness = finding.parameters["K"]
    assert stiffness["low"] < 4003.4 < stiffness["high"]  # as the simulation has it
