# SPDX-License-Identifier: BSD-3-Clause
"""Many joints fitted at once, against fits one by one."""

import numpy as np
import pytest

from skidyn.measurement._robust import fit_admissible, fit_at_once


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
