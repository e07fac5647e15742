# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

from skidyn.metrics import paired_comparison, trajectory_errors


def test_trajectory_errors_average_within_recordings():
    labels, errors = trajectory_errors(
        np.zeros((4, 2)), [[1, 0], [3, 0], [2, 1], [2, 1]], [7, 7, 3, 3]
    )
    np.testing.assert_array_equal(labels, [3, 7])
    np.testing.assert_allclose(errors, [[4, 1], [5, 0]])


def test_no_difference_is_rarely_called_one():
    rng = np.random.default_rng(0)
    called = 0
    for _ in range(200):
        first, second = rng.chisquare(20, size=(2, 8, 3))
        called += paired_comparison(first, second).p_value < 0.05
    assert called < 25


def test_consistent_gain_is_found_and_units_do_not_matter():
    rng = np.random.default_rng(0)
    first = rng.chisquare(20, size=(8, 2)) * [1.0, 1e4]
    second = first * 0.64 * rng.uniform(0.9, 1.1, size=(8, 2))
    comparison = paired_comparison(first, second)
    assert comparison.ratio == pytest.approx(0.8, abs=0.03)
    assert comparison.low < comparison.ratio < comparison.high < 1
    assert comparison.p_value < 1e-3


def test_one_recording_proves_nothing():
    comparison = paired_comparison([[1.0]], [[0.1]])
    assert comparison.high == np.inf and comparison.p_value == 1.0
