# SPDX-License-Identifier: BSD-3-Clause
import numpy as np

from skidyn.datasets import load_panda
from skidyn.identification._log_det import divergence, existing_bodies, local_units

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


def test_links_without_mass_become_small_bodies():
    empty = NOMINAL.copy()
    empty[2] = 0.0
    bodies = existing_bodies(empty)
    assert np.isfinite(divergence(bodies, bodies)) and bodies[2, 0] > 0
    np.testing.assert_array_equal(np.delete(bodies, 2, 0), np.delete(empty, 2, 0))
