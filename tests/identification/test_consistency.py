# SPDX-License-Identifier: BSD-3-Clause
import numpy as np

from skidyn.datasets import load_panda, load_planar_arm
from skidyn.identification import (
    from_pseudo_inertia,
    is_consistent,
    make_consistent,
    pseudo_inertia,
)
from skidyn.robots import find_base_parameters


def test_pseudo_inertia_of_points():
    rng = np.random.default_rng(0)
    points, masses = rng.normal(size=(6, 3)), rng.uniform(0.1, 1, 6)
    second = np.einsum("k,ki,kj->ij", masses, points, points)
    inertia = np.trace(second) * np.eye(3) - second
    own = np.r_[masses.sum(), masses @ points, inertia[np.triu_indices(3)]][None]
    matrix = pseudo_inertia(own)[0]
    np.testing.assert_allclose(matrix[:3, :3], second)
    np.testing.assert_allclose(from_pseudo_inertia(matrix[None]), own)


def test_mass_and_triangle_inequality():
    body = np.array([[1.0, 0, 0, 0, 0.1, 0, 0, 0.1, 0, 0.1]])
    assert is_consistent(body)
    assert not is_consistent(body * np.r_[-1.0, np.ones(9)])
    assert not is_consistent(body * np.r_[np.ones(9), 2.5])


def test_consistent_solution_is_kept():
    for robot in (load_planar_arm(), load_panda()):
        truth = robot.inertial_parameters * 1.1
        n = truth.size
        found, coefficients = make_consistent(
            robot.inertial_parameters,
            np.eye(n + 1),
            np.r_[truth.ravel(), 0.5],
            np.ones(1),
            np.ones(1),
        )
        np.testing.assert_allclose(found, truth, atol=2e-2)
        np.testing.assert_allclose(coefficients, 0.5, atol=1e-3)


def test_negative_friction_ends_at_zero():
    nominal = load_planar_arm().inertial_parameters
    target = np.r_[nominal.ravel(), -1.0]
    _, coefficients = make_consistent(
        nominal, np.eye(21), target, np.array([1.0]), np.array([-1.0])
    )
    assert 0 <= coefficients[0] < 1e-5


def test_a_nominal_model_that_fits_leaves_friction_to_the_data():
    nominal = load_planar_arm().inertial_parameters
    target = np.r_[nominal.ravel(), 0.7]
    found, coefficients = make_consistent(
        nominal, np.eye(21), target, np.array([1.0]), np.array([0.0])
    )
    np.testing.assert_allclose(coefficients, 0.7, rtol=1e-6)
    np.testing.assert_allclose(found, nominal, atol=1e-6)


def test_zero_torque_has_bodies_too():
    """One joint moves about a vertical axis, and nothing is measured: any bodies will do."""
    robot = load_planar_arm()
    base = find_base_parameters(robot)
    factor = np.zeros((20, 22))
    factor[:3, :20] = base.regrouping[:3]
    factor[3, 20], factor[4, 21] = 1.0, 1.0
    for size in (0.0, 1e-200):
        parameters, friction = make_consistent(
            robot.inertial_parameters, factor, np.full(20, size), np.ones(2), np.zeros(2)
        )
        assert is_consistent(parameters) and np.all(friction >= 0)
