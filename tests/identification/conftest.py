# SPDX-License-Identifier: BSD-3-Clause
"""What estimators that are drawn to the bodies of the description minimise."""

import numpy as np
import pytest

from skidyn.identification import RBDRegressor, from_pseudo_inertia, pseudo_inertia
from skidyn.robots import find_base_parameters


def divergence(matrices, nominal):
    """Log-det divergence of pseudo-inertias."""
    ratio = np.linalg.solve(nominal, matrices)
    return sum(np.trace(r) - np.linalg.slogdet(r)[1] - 4 for r in ratio)


def squared_change(matrices, nominal):
    """Squared relative change of pseudo-inertias."""
    return sum(np.trace(r @ r) for r in np.linalg.solve(nominal, matrices - nominal))


@pytest.fixture(scope="session")
def poor_log():
    """Few samples of slow motion of a robot with other bodies than described, and much noise."""

    def make(robot):
        n, rng = robot.n_joints, np.random.default_rng(0)
        X = rng.uniform(-0.3, 0.3, (60, 3 * n))
        truth = robot.inertial_parameters * rng.uniform(0.8, 1.2, (robot.n_bodies, 1))
        q, dq, ddq = X[:, :n], X[:, n : 2 * n], X[:, 2 * n :]
        y = robot.inverse_dynamics(q, dq, ddq, parameters=truth)
        return X, y + 0.3 * dq + 0.5 * np.tanh(dq / 0.003) + rng.normal(0, 0.1, y.shape)

    return make


@pytest.fixture(scope="session")
def slope(poor_log):
    """Makes the largest slope of what an estimator minimises at its solution, and the model.

    The slope is relative to that at the described bodies.
    """

    def make(robot, estimator, std):
        X, y = poor_log(robot)
        model = RBDRegressor(robot, estimator=estimator, prior_std=std).fit(X, y)
        noise = RBDRegressor(robot, estimator="weighted").fit(X, y).noise_std_
        base, described = find_base_parameters(robot), robot.inertial_parameters
        nominal = pseudo_inertia(described)
        pull = {"entropic": lambda p: 2 * divergence(p, nominal),
                "ridge": lambda p: squared_change(p, nominal)}[estimator]  # fmt: skip

        def minimised(matrices, effects):
            change = base.values(from_pseudo_inertia(matrices)) - base.values(described)
            left = np.r_[-change, -effects, 1.0]
            factors = model.evidence_.factors.items()
            residual = sum(np.sum((r @ left) ** 2) / noise[j] ** 2 for (_, j), r in factors)
            return residual + pull(matrices) / std**2

        effects = np.concatenate([model.effect_coefficients_[t] for t in model.effect_terms_])
        root = np.linalg.cholesky(nominal)
        rng, h, found = np.random.default_rng(1), 2e-5, []
        for _ in range(10):
            relative = rng.normal(size=nominal.shape)
            relative = relative + relative.transpose(0, 2, 1)
            other = rng.normal(size=effects.shape) * np.abs(effects)
            change = root @ relative @ root.transpose(0, 2, 1)
            both = []
            for start in (pseudo_inertia(model.inertial_parameters_), nominal):
                ahead, back = (minimised(start + s * change, effects + s * other) for s in (h, -h))
                both.append((ahead - back) / (2 * h))
            found.append(both)
        at_solution, at_nominal = np.abs(found).max(axis=0)
        return at_solution / at_nominal, model

    return make
