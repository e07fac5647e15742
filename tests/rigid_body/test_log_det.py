# SPDX-License-Identifier: BSD-3-Clause
import numpy as np

from skidyn.datasets import load_panda
from skidyn.rigid_body._interior_point import minimise_with_divergence
from skidyn.rigid_body._log_det import divergence, existing_bodies, local_units

NOMINAL = load_panda().inertial_parameters


def test_divergence_is_zero_at_home_and_infinite_where_no_body_is():
    assert abs(divergence(NOMINAL, NOMINAL)) < 1e-9
    assert divergence(1.1 * NOMINAL, NOMINAL) > 0
    assert divergence(-NOMINAL, NOMINAL) == np.inf


def test_local_units_are_those_of_the_divergence():
    bodies = NOMINAL * np.linspace(0.9, 1.2, 7)[:, None]
    units, gradient = local_units(bodies, NOMINAL)
    direction = np.random.default_rng(0).normal(size=(7, 10))
    change = np.einsum("nij,nj->ni", units, direction)
    step = 1e-4
    ahead, here, back = (divergence(bodies + s * change, NOMINAL) for s in (step, 0, -step))
    np.testing.assert_allclose((ahead - back) / (2 * step), np.sum(gradient * direction), rtol=1e-5)
    curvature = (ahead - 2 * here + back) / step**2
    np.testing.assert_allclose(curvature, np.sum(direction**2), rtol=1e-4)


def test_minimum_with_divergence_is_one():
    rng = np.random.default_rng(1)
    units, _ = local_units(NOMINAL, NOMINAL)
    factor = rng.normal(size=(20, 70)) * 3
    target = factor @ NOMINAL.ravel() + rng.normal(size=20)

    def objective(x):
        error = np.sum((factor @ x - target) ** 2) / 2
        return error + 0.5 * divergence(x.reshape(-1, 10), NOMINAL)

    best = minimise_with_divergence(factor, target, NOMINAL.ravel(), NOMINAL, 0.5)
    for _ in range(20):
        change = np.einsum("nij,nj->ni", units, rng.normal(size=(7, 10))).ravel()
        assert objective(best) < objective(best + 1e-3 * change)


def test_links_without_mass_become_small_bodies():
    empty = NOMINAL.copy()
    empty[2] = 0.0
    bodies = existing_bodies(empty)
    assert np.isfinite(divergence(bodies, bodies)) and bodies[2, 0] > 0
    np.testing.assert_array_equal(np.delete(bodies, 2, 0), np.delete(empty, 2, 0))
