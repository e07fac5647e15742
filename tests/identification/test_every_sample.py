# SPDX-License-Identifier: BSD-3-Clause
"""When every sample is a row of the fit."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.identification import RBDRegressor

ROBOT = load_planar_arm()


def test_rows_without_a_clock_are_samples():
    X = np.random.default_rng(0).uniform(-2, 2, (300, 6))
    y = ROBOT.inverse_dynamics(X[:, :2], X[:, 2:4], X[:, 4:]) + 0.3 * X[:, 2:4]
    assert RBDRegressor(ROBOT).fit(X, y).rows_ == "samples"


@pytest.mark.parametrize("effects", [("viscous", "dahl"), ("viscous", "coulomb")])
def test_positions_alone_are_averaged(effects):
    log = make_hidden_effect_log(ROBOT, None, n_trajectories=3, duration=3.0)
    assert RBDRegressor(ROBOT, effects).fit(log.X, log.y).rows_ == "averaged"
