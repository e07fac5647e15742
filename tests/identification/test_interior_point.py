# SPDX-License-Identifier: BSD-3-Clause
"""Minimum with a pull toward given bodies."""

import pytest

from skidyn.datasets import load_panda, load_planar_arm
from skidyn.identification import is_consistent


@pytest.mark.parametrize("load", [load_planar_arm, load_panda])
@pytest.mark.parametrize("std", [10.0, 1.4, 0.01])
def test_the_entropic_estimator_minimises_residual_and_divergence(load, std, slope):
    left, model = slope(load(), "entropic", std)
    assert left < 1e-6
    assert is_consistent(model.inertial_parameters_)
