# SPDX-License-Identifier: BSD-3-Clause
"""A log is cut into pieces that never cross a trajectory."""

import numpy as np

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.identification import RBDRegressor
from skidyn.simulation import simulate


def test_pieces_start_on_the_log_and_never_cross_a_trajectory():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=2.0)
    model = RBDRegressor(log.robot).fit(log.X, log.y)
    out = simulate(model, log.X, log.y, horizon=0.5)
    second = np.flatnonzero(log.X["trajectory"] == 2)[0]
    assert abs(out["q1"].iloc[second] - log.X["q1"].iloc[second]) < 1e-3
    assert list(out.columns) == list(log.X.columns)
    assert np.isfinite(out["q1"]).all()
