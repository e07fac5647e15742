# SPDX-License-Identifier: BSD-3-Clause
"""Bodies that differ from those of the description."""

from dataclasses import replace

import numpy as np


def test_bodies_near_those_of_the_description_are_no_other_zero(arm, short, told_of):
    """A centre of mass aside of its link looks like a zero of the joint that is off by 14 deg."""
    bodies = np.asarray(arm.inertial_parameters, dtype=float).reshape(-1, 10).copy()
    aside = np.array([1.0, -1.0, 0.0]) / np.sqrt(2)
    bodies[0, 1:4] += 0.8 * np.linalg.norm(bodies[0, 1:4]) * aside
    assert "reading" not in told_of(short, replace(arm, inertial_parameters=bodies))
