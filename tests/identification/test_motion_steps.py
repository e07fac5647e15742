# SPDX-License-Identifier: BSD-3-Clause
"""Steps of the output-error estimator stay among the bodies that can exist."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.identification import RBDRegressor, is_consistent
from skidyn.simulation import simulation_errors


@pytest.mark.slow
def test_consistent_refines_where_the_torque_asks_for_impossible_bodies():
    """Steps past the possible bodies would end with the advice to use what was used."""
    clean = make_hidden_effect_log(
        load_planar_arm(), None, n_trajectories=1, duration=8.0, random_state=0
    )
    X = clean.X
    bodies = clean.robot.inertial_parameters.copy()
    bodies[-1, 4:] *= -1.0
    q, dq = (X[[f"{k}1", f"{k}2"]].to_numpy() for k in ("q", "dq"))
    ddq = np.gradient(dq, X["time"], axis=0)
    torque = clean.robot.inverse_dynamics(q, dq, ddq, parameters=bodies)
    words = {"consistent": True, "horizon": 0.25}
    plain = RBDRegressor(clean.robot, **words).fit(X, torque)
    refined = RBDRegressor(clean.robot, estimator="output_error", **words).fit(X, torque)
    scores = [simulation_errors(m, X, torque, horizon=0.25).score for m in (plain, refined)]
    assert scores[1] < 0.99 * scores[0]
    assert np.all(is_consistent(refined.inertial_parameters_))
    assert np.all(np.concatenate(list(refined.effect_coefficients_.values())) >= 0.0)
