# SPDX-License-Identifier: BSD-3-Clause
"""Signals of unknown torques, also where none of them alone tells anything."""

import numpy as np

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


def centered(x):
    """Deviation from the mean, in standard deviations."""
    return (x - x.mean()) / x.std()


def test_signals_that_tell_nothing_alone_are_found_in_a_short_log():
    log = make_hidden_effect_log(
        load_planar_arm(), None, n_trajectories=4, duration=4.0, random_state=11
    )
    y = np.array(log.y, dtype=float)
    # dry friction of joint 2, stronger at both ends of joint 1: zero on average over either of them
    y[:, 0] += 0.4 * np.sign(log.X["dq2"]) * (centered(log.X["q1"]).abs() - 0.8)

    diagnosis = diagnose(RBDRegressor(log.robot, ("viscous", "coulomb")), log.X, y, checks=())

    assert diagnosis.verdict == "unknown"
    (finding,) = diagnosis.findings
    assert finding.joints == (1,)
    assert set(finding.variables) == {"dq2", "q1"}
