# SPDX-License-Identifier: BSD-3-Clause
"""Variance and degrees of freedom of scores that come from few blocks of time."""

import numpy as np
import pytest

from skidyn.diagnosis._chance import degrees_of_freedom, unbiased_scores


def blocks_of(columns, torque, length):
    """Score over all rows; scores of blocks with the torque that the columns leave; products."""
    left = torque - columns @ np.linalg.lstsq(columns, torque, rcond=None)[0]
    parts = np.split(np.arange(len(torque)), np.arange(length, len(torque), length))
    sums = np.array([columns[rows].T @ left[rows] for rows in parts])
    return columns.T @ torque, sums, np.array([columns[r].T @ columns[r] for r in parts])


@pytest.mark.parametrize("largest", [1.0, 5.0])
def test_the_variance_from_six_blocks_is_right_on_average_also_if_one_holds_most(largest):
    rng = np.random.default_rng(0)
    columns = rng.normal(size=(60, 2))
    columns[:10] *= largest
    squares = []
    for _ in range(2000):
        score, sums, _ = unbiased_scores(*blocks_of(columns, rng.normal(size=60), 10))
        squares.append([score**2, (sums**2).sum(0)])
    of_scores, of_blocks = np.mean(squares, axis=0)

    assert of_scores == pytest.approx([1.0, 1.0], abs=0.1)
    assert of_blocks == pytest.approx([1.0, 1.0], abs=0.1)


def test_equal_blocks_have_a_degree_of_freedom_less_than_their_number_and_unequal_ones_fewer():
    equal = np.full((8, 1, 1), 1 / 8)
    unequal = np.array([0.65, *[0.05] * 7])[:, None, None]

    assert degrees_of_freedom(equal) == pytest.approx(7.0)
    assert degrees_of_freedom(unequal) < 3.0
