# SPDX-License-Identifier: BSD-3-Clause
"""Inertial parameters in other frames."""

import numpy as np
from scipy.spatial.transform import Rotation

from skidyn.dynamics import inertial_parts, inertial_vector, skew, transform_inertial

RNG = np.random.default_rng(0)


def point_masses(positions):
    """Parameters of unit masses at some points, about the origin."""
    inertia = sum(-skew(p) @ skew(p) for p in positions)
    return inertial_vector(len(positions), positions.sum(axis=0), inertia)


def test_skew_is_the_cross_product():
    a, b = RNG.normal(size=(2, 3))
    np.testing.assert_allclose(skew(a) @ b, np.cross(a, b))


def test_another_frame_sees_the_same_masses_elsewhere():
    points = RNG.normal(size=(5, 3))
    rotation, shift = Rotation.random(random_state=0).as_matrix(), RNG.normal(size=3)
    moved = transform_inertial(point_masses(points), rotation, shift)
    np.testing.assert_allclose(moved, point_masses(points @ rotation.T + shift), atol=1e-12)


def test_parts_make_the_vector_again():
    parameters = RNG.normal(size=10)
    np.testing.assert_array_equal(inertial_vector(*inertial_parts(parameters)), parameters)
