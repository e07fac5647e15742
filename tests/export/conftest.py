# SPDX-License-Identifier: BSD-3-Clause
"""Robots and fitted models that the exports are compared with."""

from __future__ import annotations

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_planar_arm, load_scara, load_ur5
from skidyn.effects import Term
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

INERTIA = '<inertia ixx="0.3" iyy="0.2" izz="0.2" ixy="0.01" ixz="0" iyz="0"/>'

#: A branch, a slider, a joint that follows another, a link fixed to a moving one.
TREE = f"""
<robot name="tree"><link name="base"/>
  <link name="left"><inertial><origin xyz="0.1 0 0"/><mass value="1"/>{INERTIA}</inertial></link>
  <link name="right"><inertial><origin xyz="0 0.1 0"/><mass value="2"/>{INERTIA}</inertial></link>
  <link name="pad"><inertial><origin xyz="0 0.1 0"/><mass value="0.3"/>{INERTIA}</inertial></link>
  <link name="arm"><inertial><origin xyz="0.2 0.1 0"/><mass value="1"/>{INERTIA}</inertial></link>
  <joint name="lead" type="prismatic"><parent link="base"/><child link="left"/>
    <origin xyz="1 2 3" rpy="0.1 1.5707963267948966 0.3"/><axis xyz="1 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="follow" type="continuous"><parent link="left"/><child link="right"/>
    <origin rpy="0.4 -0.2 0.3"/><axis xyz="0 1 1"/>
    <mimic joint="lead" multiplier="-2" offset="0.3"/></joint>
  <joint name="glue" type="fixed"><parent link="right"/><child link="pad"/>
    <origin xyz="0 0 1" rpy="1 2 3"/></joint>
  <joint name="turn" type="revolute"><parent link="base"/><child link="arm"/>
    <origin xyz="0 0.3 0" rpy="0.5 0.2 0"/><axis xyz="0 1 0"/>
    <limit lower="-4" upper="4" velocity="1" effort="9"/></joint>
</robot>
"""

#: Effects that are functions of q, dq and ddq, with the shape parameters some of them need.
STATIC = (
    *("viscous", "coulomb", "offset", "asymmetric_friction", "rotor_inertia", "spring"),
    *("load_dependent_friction", "torque_gain", "external_wrench"),
    Term("stribeck", (1,), {"vs": 0.1, "delta": 2.0}),
    Term("nonlinear_viscous", (2,), {"power": 1.7}),
    Term("position_dependent_friction", (2,), {"n": 2.0}),
    Term("position_dependent_friction", (1,), {"n": 2.0, "viscous": 1.0}),
    Term("rotor_inertia", (2,), {"varying": 1.0, "q_middle": 0.2}),
    Term("torque_ripple", (2,), {"N": 30.0}),
    Term("coupled_friction", (1, 2), {"ratio": -0.5}),
    Term("coupled_inertia", (1, 2), {"ratio": 0.5}),
    Term("coupling_spring", (1, 2), {"ratio": 1.0}),
    Term("coupling_spring", (1, 2), {"ratio": -1.0, "x0": 0.1, "bent": 1.0}),
    Term("coupling_spring", (1, 2), {"ratio": 0.5, "x0": 0.1, "slack": 0.2}),
    Term("nonlinear_spring", (1,), {"q_middle": 0.2}),
    ("gravity_compensator", [2]),
    Term("gravity_compensator", (1,), {"aligned": 0.3, "lever": 0.4}),
    Term("end_stop", (2,), {"q_lim": 0.3, "side": 1.0}),
    Term("end_stop", (1,), {"q_lim": 0.3, "side": 1.0, "q_further": 0.8}),
    Term("saturation", (1,), {"limit": 0.5}),
    Term("saturation", (2,), {"limit": 0.5, "limit_below": 0.4}),
)

LOADERS = {
    "tree": lambda: Robot.from_urdf(TREE),
    "scara": load_scara,
    "planar_arm": load_planar_arm,
    "ur5": load_ur5,
    "panda": load_panda,
}


def make_states(robot, n_samples=60, seed=1):
    """Random motion; partly so slow that the direction of dry friction is blurred."""
    q, dq, ddq = np.random.default_rng(seed).normal(size=(3, n_samples, robot.n_joints))
    dq[:10] *= 1e-3
    return q, dq, ddq


def fit_model(robot, effects, **options):
    """A model fitted to torques in which everything is a little."""
    motion = make_states(robot, 300, seed=0)
    q, dq, ddq = motion
    torque = robot.inverse_dynamics(*motion, parameters=1.2 * robot.inertial_parameters)
    torque += 0.3 * dq + 0.2 * np.tanh(dq / 0.003) + 0.1 * ddq + 0.4 * q + 0.05
    return RBDRegressor(robot, effects, **options).fit(np.hstack(motion), torque)


@pytest.fixture(scope="session")
def states():
    """Function that makes a random motion of a robot."""
    return make_states


@pytest.fixture(scope="session")
def fit():
    """Function that fits a model of a robot with given effects."""
    return fit_model


@pytest.fixture(scope="session")
def load():
    """Function that makes a robot by its name."""
    return lambda name: LOADERS[name]()


@pytest.fixture(scope="session")
def models():
    """Fitted models by the name of their robot, with every effect a function can hold."""
    return {name: fit_model(LOADERS[name](), STATIC) for name in ("tree", "scara")}


@pytest.fixture(scope="session")
def consistent():
    """Fitted models of bodies that can exist."""
    effects = ("viscous", "coulomb", "rotor_inertia")
    return {name: fit_model(load(), effects, consistent=True) for name, load in LOADERS.items()}
