# SPDX-License-Identifier: BSD-3-Clause
"""The maximum of a likelihood between the points that are computed."""

import numpy as np
import pytest

from skidyn.measurement._peak import climb, peak, vertex


@pytest.mark.parametrize("start", [-1.0, 0.2, 1.5])
def test_the_maximum_is_found_between_the_points(start):
    assert peak(lambda x: -np.log(1 + (x - 0.37) ** 2), start, 0.7) == pytest.approx(0.37, abs=0.01)


def test_a_likelihood_that_is_bent_upwards_is_climbed():
    assert peak(lambda x: x**2, 1.0, 0.5) > 1.0


def test_a_cusp_is_not_jumped_over():
    assert peak(lambda x: -(abs(x - 0.1) ** 0.7), 1.0, 0.4) == pytest.approx(0.1, abs=0.2)


def test_the_vertex_of_a_parabola():
    assert vertex(*(-((x - 0.3) ** 2) for x in (-1, 0, 1))) == pytest.approx(0.3)
    assert vertex(1.0, 0.0, 1.0) is None


def test_a_narrow_maximum_is_climbed_by_halved_steps():
    place, value = climb(lambda x: -abs(x - 0.37), 1.0, 0.5, 1e-3)
    assert place == pytest.approx(0.37, abs=2e-3)
    assert value == -abs(place - 0.37)


def test_a_climb_ends_where_it_leaves_its_reach():
    place, _ = climb(lambda x: x, 0.0, 1.0, 1e-3, reach=2.5)
    assert place == 3.0
