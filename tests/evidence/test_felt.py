# SPDX-License-Identifier: BSD-3-Clause
"""Products of the columns that a joint feels are those of all columns."""

from types import SimpleNamespace

import numpy as np
import pytest

from skidyn.evidence import felt_columns, gram_of, products_with

ROWS = (30, 20)


@pytest.fixture
def columns():
    """Three columns of the rigid body, the first not felt by the second joint, and two effects."""
    rng = np.random.default_rng(0)
    rigid = [rng.normal(size=(n, 3)) for n in ROWS]
    rigid[1][:, 0] = 0.0
    problem = SimpleNamespace(rigid_index=range(3), rigid_rows=rigid)
    blocks = [
        {1: rng.normal(size=(20, 2))},
        {j: rng.normal(size=(n, 1)) for j, n in enumerate(ROWS)},
    ]
    whole = [np.hstack([rows, np.zeros((len(rows), 3))]) for rows in rigid]
    whole[1][:, 3:5] = blocks[0][1]
    for j in (0, 1):
        whole[j][:, 5:] = blocks[1][j]
    return problem, blocks, whole


def test_columns_that_vanish_on_a_joint_are_left_out(columns):
    felt, width = felt_columns(*columns[:2])
    assert width == 6
    assert [own.places.tolist() for own in felt] == [[0, 1, 2, 5], [1, 2, 3, 4, 5]]
    for own, whole in zip(felt, columns[2], strict=True):
        np.testing.assert_array_equal(own.rows, whole[:, own.places])


def test_products_are_those_of_all_columns(columns):
    problem, blocks, whole = columns
    sigma = np.array([0.5, 2.0])
    felt, width = felt_columns(problem, blocks, sigma)
    scaled = [rows / s for rows, s in zip(whole, sigma, strict=True)]
    np.testing.assert_allclose(gram_of(felt, width), sum(a.T @ a for a in scaled))
    other = {1: np.random.default_rng(1).normal(size=(20, 2))}
    np.testing.assert_allclose(products_with(felt, other, width), scaled[1].T @ other[1])


def test_further_columns_take_their_places(columns):
    felt, _ = felt_columns(*columns[:2])
    wider = felt[1].with_columns(6, np.ones((20, 2)))
    assert wider.places.tolist() == [1, 2, 3, 4, 5, 6, 7]
    np.testing.assert_array_equal(wider.rows[:, -2:], 1.0)
