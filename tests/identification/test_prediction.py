# SPDX-License-Identifier: BSD-3-Clause
"""Predictions of a fitted pendulum, and the parts that they are made of."""

import numpy as np
import pytest

from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

PENDULUM = """<robot name="pendulum"><link name="base"/>
<link name="rod"><inertial><origin xyz="0.2 0 0"/><mass value="1.5"/>
<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j1" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="50" velocity="3"/></joint></robot>"""
ROBOT = Robot.from_urdf(PENDULUM)
X = np.random.default_rng(0).uniform(-1, 1, (300, 3))
TORQUE = ROBOT.inverse_dynamics(X[:, :1], X[:, 1:2], X[:, 2:])[:, 0] + 0.4 * X[:, 1]


@pytest.fixture(scope="module")
def model():
    return RBDRegressor(ROBOT, ("viscous",)).fit(X, TORQUE)


def test_one_joint_may_have_flat_torque(model):
    assert model.predict(X).shape == TORQUE.shape
    np.testing.assert_allclose(model.predict(X), TORQUE, atol=1e-6)


def test_effects_are_what_the_rigid_body_leaves(model):
    body = model.rigid_body_torque(X[:, :1], X[:, 1:2], X[:, 2:])[:, 0]
    ((friction,),) = model.effect_coefficients_.values()
    np.testing.assert_allclose(model.predict(X) - body, friction * X[:, 1], atol=1e-12)


def test_bands_lie_around_the_prediction(model):
    low, high = model.predict_interval(X)
    np.testing.assert_allclose((low + high) / 2, model.predict(X), atol=1e-9)
    assert (high > low).all()
