# SPDX-License-Identifier: BSD-3-Clause
"""The maximum of a likelihood between the points that are computed."""

import numpy as np
import pytest

from skidyn.measurement._peak import peak


@pytest.mark.parametrize("start", [-1.0, 0.2, 1.5])
def test_the_maximum_is_found_between_the_points(start):
    assert peak(lambda x: -np.log(1 + (x - 0.37) ** 2), start, 0.7) == pytest.approx(0.37, abs=0.01)


def test_a_likelihood_that_is_bent_upwards_is_climbed():
    assert peak(lambda x: x**2, 1.0, 0.5) > 1.0


def test_a_cusp_is_not_jumped_over():
    assert peak(lambda x: -(abs(x - 0.1) ** 0.7), 1.0, 0.4) == pytest.approx(0.1, abs=0.2)
