# SPDX-License-Identifier: BSD-3-Clause
"""Minimum with a pull toward given bodies."""

import numpy as np
import pytest

from skidyn.datasets import load_panda
from skidyn.identification._interior_point import minimise_with_divergence
from skidyn.identification._log_det import local_units

NOMINAL = load_panda().inertial_parameters


@pytest.mark.parametrize("weight", [1e-2, 0.5, 1e4])
def test_minimum_with_divergence_is_one(weight):
    rng = np.random.default_rng(1)
    units, _ = local_units(NOMINAL, NOMINAL)
    factor = rng.normal(size=(20, 70)) * 3
    target = factor @ NOMINAL.ravel() + rng.normal(size=20)

    best = minimise_with_divergence(factor, target, NOMINAL.ravel(), NOMINAL, weight)
    gradient = factor.T @ (factor @ best - target)
    local, slope = local_units(best.reshape(-1, 10), NOMINAL)
    rise = np.einsum("nij,ni->nj", local, gradient.reshape(-1, 10)) + weight * slope
    start = np.einsum(
        "nij,ni->nj", units, (factor.T @ (factor @ NOMINAL.ravel() - target)).reshape(-1, 10)
    )
    assert np.abs(rise).max() < 1e-6 * np.abs(start).max()
