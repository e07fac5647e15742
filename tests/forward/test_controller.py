# SPDX-License-Identifier: BSD-3-Clause
"""The gains of a controller are found from a log."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor
from skidyn.simulation import Controller, fit_controller, simulation_errors


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(load_planar_arm(), "spring", joints=[1], n_trajectories=4)


@pytest.fixture(scope="module")
def models(log):
    train = log.frame["trajectory"] <= 3
    plain = RBDRegressor(log.robot).fit(log.X[train], log.y[train])
    with_spring = plain.with_effects([("spring", [1])]).fit(log.X[train], log.y[train])
    return plain, with_spring


def test_controller_is_found_from_a_log_and_closes_the_loop(log, models):
    frame = log.X[log.frame["trajectory"] == 4].reset_index(drop=True)
    late = frame[["q1", "q2"]].shift(3).bfill()
    torque = 80 * (late.to_numpy() - frame[["q1", "q2"]]) - 5 * frame[["dq1", "dq2"]].to_numpy()
    frame = frame.assign(q_ref1=frame["q1"], q_ref2=frame["q2"])
    found = fit_controller(frame, torque)
    np.testing.assert_allclose(found.stiffness, 80, rtol=1e-3)
    np.testing.assert_allclose(found.damping, 5, rtol=1e-2)
    np.testing.assert_allclose(found.delay, 0.03, atol=1e-9)
    assert not found.follows_velocity
    gains = Controller(stiffness=2000.0, damping=100.0)
    errors = simulation_errors(models[1], frame, controller=gains)
    assert errors.position.max() < 0.05


def test_a_voltage_lets_the_torque_fall_with_the_speed():
    servo = Controller(10.0, 0.0, limit=(2.0, 2.0), no_load_speed=(4.0, np.inf)).checked(2)
    speeds = np.array([[0.0, 0.0], [2.0, 2.0], [-2.0, -2.0], [6.0, 6.0]])
    ahead = np.full_like(speeds, 5.0)
    torque = servo.torque(0 * speeds, speeds, ahead, 0 * speeds)
    np.testing.assert_allclose(torque[:, 0], [2.0, 1.0, 3.0, -1.0])
    np.testing.assert_allclose(torque[:, 1], 2.0)
    np.testing.assert_allclose(servo.torque(0 * speeds, speeds, -ahead, 0 * speeds)[1], [-3, -2])


@pytest.mark.parametrize("words", [{}, {"limit": 2.0, "no_load_speed": 0.0}])
def test_a_torque_without_limit_cannot_fall(words):
    with pytest.raises(SkidynError, match="as limit the torque at rest"):
        Controller(10.0, **({"no_load_speed": 4.0} | words)).checked(1)
