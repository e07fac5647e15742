# SPDX-License-Identifier: BSD-3-Clause
"""Physics that a network reads."""

from importlib.resources import files

import numpy as np

from skidyn.identification import RBDRegressor
from skidyn.neural_network import SDLRegressor


def fitted(arm_log, physics=None, **parameters):
    robot, X, y = arm_log
    settings = {"window": 8, "hidden_size": 12, "max_epochs": 10, "random_state": 0} | parameters
    return SDLRegressor(physics or robot, **settings).fit(X, y)


def test_physics_with_effects(arm_log):
    """The network has less to learn where the physics has the friction."""
    robot, X, y = arm_log
    physics = RBDRegressor(robot, ("viscous", "coulomb"), trajectory="trajectory")
    bare, complete = fitted(arm_log, max_epochs=3), fitted(arm_log, physics, max_epochs=3)
    errors = [np.abs(model.rigid_body_torque(X) - y).mean() for model in (bare, complete)]
    assert errors[1] < 0.5 * errors[0]
    assert len(complete.coef_) == robot.inertial_parameters.size + 2 * 2
    assert np.abs(complete.coef_[-4:]).max() > 0  # friction is optimised as well
    assert complete.score(X, y) > bare.score(X, y) - 0.01
    assert "effect_coefficients_" not in vars(physics)  # the one given stays as it is
    far = X.assign(q1=X["q1"] + 50.0)
    np.testing.assert_allclose(complete.predict(far), complete.rigid_body_torque(far))


def test_physics_may_be_a_file(arm_log, tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text((files("skidyn.datasets") / "robots" / "planar_arm.urdf").read_text())
    _, X, y = arm_log
    assert fitted((None, X, y), str(path), max_epochs=1, cv=None).predict(X).shape == y.shape
