# SPDX-License-Identifier: BSD-3-Clause
from dataclasses import replace

import numpy as np

from skidyn.evidence import own_noise, weighted_least_squares


def test_noise_of_joints_follows_the_torque(planar_problem):
    made = planar_problem(6)
    noise = made.own_noise(made.terms)
    louder = replace(made, torque=made.torque + np.random.default_rng(0).normal(size=(7200, 2)))
    assert np.all(louder.own_noise(made.terms) > 2 * noise)
    np.testing.assert_array_equal(made.own_noise(made.terms), noise)


def test_with_hardly_more_rows_than_columns_the_torque_bounds_the_noise():
    rng = np.random.default_rng(0)
    design, torque = rng.normal(size=(8, 6)), rng.normal(size=8)
    assert own_noise(design, torque, 8) == np.sqrt(np.mean(torque**2))
    longer = np.vstack([design, rng.normal(size=(40, 6))])
    noise = 0.1 * rng.normal(size=48)
    assert own_noise(longer, longer @ np.ones(6) + noise, 42) < 0.2


def test_joints_count_by_their_noise():
    rows = np.ones((50, 1))
    coefficient = weighted_least_squares(
        [rows, rows], [0 * rows[:, 0], rows[:, 0]], np.r_[1.0, 0.1]
    )
    np.testing.assert_allclose(coefficient, 100 / 101)
