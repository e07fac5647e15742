# SPDX-License-Identifier: BSD-3-Clause
"""What is known about bodies is kept, and contradictions are reported."""

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_planar_arm
from skidyn.identification import (
    BodyConstraints,
    RBDRegressor,
    is_consistent,
    make_consistent,
    pseudo_inertia,
)

ROBOT = load_planar_arm()
KNOWN = {
    "mass": {"link1": (1.8, 1.9), "link2": (0.5, 2.0)},
    "centre_of_mass": {"link2": ((0.1, -0.01, -np.inf), (0.2, 0.01, np.inf))},
    "symmetry": {"link2": "z"},
    "total_mass": 3.2,
}


def check(parameters):
    mass, centre = parameters[:, 0], parameters[1, 1:4] / parameters[1, 0]
    assert is_consistent(parameters)
    assert 1.8 < mass[0] < 1.9 and 0.5 < mass[1] < 2.0
    np.testing.assert_allclose(mass.sum(), 3.2, rtol=1e-6)
    assert 0.1 < centre[0] < 0.2 and abs(centre[1]) < 0.01
    np.testing.assert_allclose(parameters[1, [3, 6, 8]], 0.0, atol=1e-6)


@pytest.mark.parametrize("noise", [0.1, 100.0])
def test_knowledge_is_kept_whatever_the_data(noise):
    rng = np.random.default_rng(0)
    X = rng.uniform(-2, 2, (200, 6))
    y = ROBOT.inverse_dynamics(X[:, :2], X[:, 2:4], X[:, 4:]) + rng.normal(0, noise, (200, 2))
    model = RBDRegressor(ROBOT, consistent=BodyConstraints(**KNOWN)).fit(X, y)
    check(model.inertial_parameters_)
    assert all(np.all(c >= 0) for c in model.effect_coefficients_.values())


def squared_error(factor, target, parameters, coefficients):
    return np.sum((factor @ np.r_[parameters.ravel(), coefficients] - target) ** 2)


def by_semidefinite_program(nominal, factor, target):
    """The least squared error over bodies that can exist, by cvxpy."""
    cp = pytest.importorskip("cvxpy")
    basis, matrices = pseudo_inertia(np.eye(10)), pseudo_inertia(nominal)
    x = cp.Variable(nominal.size)
    conditions = []
    for body, matrix in enumerate(matrices):
        # Congruence with the nominal body makes all eigenvalues comparable.
        root = np.linalg.inv(np.linalg.cholesky(matrix))
        own = sum(x[10 * body + k] * basis[k] for k in range(10))
        conditions.append(root @ own @ root.T >> 0)
    problem = cp.Problem(cp.Minimize(cp.sum_squares(factor @ x - target)), conditions)
    return problem.solve(solver=cp.CLARABEL)


@pytest.mark.parametrize("noise", [1.0, 30.0])
def test_no_semidefinite_program_finds_a_smaller_error(noise):
    robot, rng = load_panda(), np.random.default_rng(0)
    q, dq, ddq = rng.uniform(-1.5, 1.5, (3, 300, 7))
    columns = robot.torque_regressor(q, dq, ddq).reshape(-1, 70)
    truth = robot.inertial_parameters * rng.uniform(0.7, 1.3, (7, 1))
    torque = columns @ truth.ravel() + noise * rng.normal(size=2100)
    factor = np.linalg.qr(np.column_stack([columns, torque]), mode="r") / noise
    factor, target = factor[:, :-1], factor[:, -1]
    nominal = robot.inertial_parameters
    found = make_consistent(nominal, factor, target, np.zeros(0), np.zeros(0))
    assert is_consistent(found[0])
    least = by_semidefinite_program(nominal, factor, target)
    # What the data leaves open is pulled toward the nominal bodies, which costs a trace of error.
    assert squared_error(factor, target, *found) == pytest.approx(least, rel=1e-3)


@pytest.mark.parametrize(
    ("known", "message"),
    [
        ({"mass": {"hand": (1, 2)}}, "no body 'hand'; there are link1, link2"),
        ({"mass": {"link1": (2, 1)}}, "mass of 'link1'"),
        ({"mass": {"link1": (1, 2), "link2": (1, 2)}, "total_mass": 9.0}, "total_mass=9"),
        ({"centre_of_mass": {"link1": ((0, 0, 1), (1, 1, 0))}}, "z between 1 and 0 m is empty"),
        ({"symmetry": {"link1": "w"}}, "'w' is not an axis"),
        (
            {"centre_of_mass": {"link1": ((0.1,) * 3, (0.2,) * 3)}, "symmetry": {"link1": "y"}},
            "is symmetric about y = 0",
        ),
    ],
)
def test_contradictions_are_told(known, message):
    X = np.random.default_rng(0).uniform(-2, 2, (50, 6))
    model = RBDRegressor(ROBOT, consistent=BodyConstraints(**known))
    with pytest.raises(ValueError, match=message):
        model.fit(X, X[:, :2])
