# SPDX-License-Identifier: BSD-3-Clause
"""The bodies of the URDF help where a log is poor."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.identification import RBDRegressor, is_consistent
from skidyn.robots import find_base_parameters

ROBOT = load_planar_arm()


def motion(n=600, seed=0, speed=2.0):
    return np.random.default_rng(seed).uniform(-speed, speed, (n, 6))


def torque(X, parameters=None):
    rigid = ROBOT.inverse_dynamics(X[:, :2], X[:, 2:4], X[:, 4:], parameters=parameters)
    return rigid + 0.3 * X[:, 2:4] + 0.5 * np.tanh(X[:, 2:4] / 0.003)


def poor_log(seed):
    """Few samples of slow motion, much noise."""
    X = motion(40, seed, speed=0.3)
    truth = ROBOT.inertial_parameters * np.random.default_rng(seed).uniform(0.8, 1.2, (2, 1))
    noise = np.random.default_rng(seed + 1).normal(0, 1.0, (40, 2))
    return X, torque(X, truth) + noise, truth


def least_squares(X, y):
    """Changes of the base parameters and friction by plain least squares, and the model's."""
    model = RBDRegressor(ROBOT).fit(X, y)
    noise = dict(enumerate(model.noise_std_))
    change = model.evidence_.solve(noise=noise)
    base = find_base_parameters(ROBOT)
    change[: len(base.index)] += base.values(ROBOT.inertial_parameters)
    return change


@pytest.mark.parametrize("estimator", ["weighted", "ridge", "entropic"])
def test_the_urdf_helps_where_the_log_is_poor(estimator):
    gains = []
    base = find_base_parameters(ROBOT)
    for seed in range(5):
        X, y, truth = poor_log(seed)
        new = motion(300, seed=9)
        wanted = torque(new, truth)
        plain = least_squares(X, y)
        regressor = np.asarray(ROBOT.torque_regressor(new[:, :2], new[:, 2:4], new[:, 4:]))
        rigid = regressor[:, :, base.index] @ plain[: len(base.index)]
        rest = new[:, 2:4] * plain[-4:-2] + np.tanh(new[:, 2:4] / 0.003) * plain[-2:]
        model = RBDRegressor(ROBOT, estimator=estimator).fit(X, y)
        errors = (np.linalg.norm(p - wanted) for p in (rigid + rest, model.predict(new)))
        before, after = errors
        gains.append(after / before)
    assert np.median(gains) < 0.8


def test_entropic_bodies_always_exist():
    for seed in range(10):
        X = motion(60, seed)
        y = np.random.default_rng(seed).normal(0, 10.0 ** (seed / 2 - 2), (60, 2))
        model = RBDRegressor(ROBOT, estimator="entropic").fit(X, y)
        assert is_consistent(model.inertial_parameters_)


def test_strong_priors_keep_the_urdf_and_weak_ones_least_squares():
    X, y, _ = poor_log(0)
    for estimator in ("ridge", "entropic"):
        strong = RBDRegressor(ROBOT, estimator=estimator, prior_std=1e-6).fit(X, y)
        nominal = ROBOT.inertial_parameters
        np.testing.assert_allclose(strong.inertial_parameters_, nominal, atol=1e-6)
    weak = RBDRegressor(ROBOT, estimator="ridge", prior_std=1e5).fit(X, y)
    np.testing.assert_allclose(weak.coef_, least_squares(X, y), rtol=1e-3, atol=1e-3)
