# SPDX-License-Identifier: BSD-3-Clause
"""Many joints fitted at once, against fits one by one."""

import numpy as np
import pytest

from skidyn.measurement._robust import fit_admissible, fit_at_once, fit_together


@pytest.mark.parametrize("seed", range(3))
def test_joints_fitted_at_once_are_those_fitted_one_by_one(seed):
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(6, 80, 4)) * 10.0 ** rng.uniform(-2, 2, 4)
    signs = rng.choice([-1.0, 1.0], size=(6, 4))
    y = np.einsum("frc,fc->fr", columns, signs) + rng.normal(size=(6, 80)) + 3.0
    use = rng.random((6, 80)) < 0.8
    for k, fit in enumerate(fit_at_once(columns, y, use)):
        alone = fit_admissible(columns[k, use[k]], y[k, use[k]], rounds=1)
        np.testing.assert_allclose(fit.coefficients, alone.coefficients, rtol=1e-6, atol=1e-8)
        assert fit.likelihood == pytest.approx(alone.likelihood)
        assert fit.coefficients.min() >= 0


@pytest.mark.parametrize("factor", [1e-3, 1e5])
def test_common_coefficients_do_not_depend_on_the_unit_of_the_torque(factor):
    rng = np.random.default_rng(1)
    designs = [rng.normal(size=(200, 3)) for _ in range(2)]
    places = [np.array([0, 1, 2]), np.array([1, 2, 3])]
    truth = np.array([1.0, -2.0, 3.0, 0.5])
    targets = [
        d @ truth[p] + 0.1 * rng.normal(size=200) for d, p in zip(designs, places, strict=True)
    ]
    plain = fit_together(designs, places, targets)
    other = fit_together(designs, places, [factor * y for y in targets])
    for one, two in zip(plain, other, strict=True):
        np.testing.assert_allclose(two.coefficients, factor * one.coefficients, rtol=1e-6)
