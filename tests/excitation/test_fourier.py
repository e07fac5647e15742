# SPDX-License-Identifier: BSD-3-Clause
"""Fourier series and windows, each with two derivatives."""

import numpy as np
import pytest

from skidyn.excitation import fourier, product, rest_window

TIME = np.linspace(0.0, 7.0, 7001)
WAVE = fourier(TIME, 0.9, np.array([0.7, -0.2, 0.1, 0.4]))
WINDOW = rest_window(TIME, 7.0, 2.0)


@pytest.mark.parametrize("function", [WAVE, WINDOW, product(WINDOW, WAVE)])
def test_derivatives_are_those_of_the_value(function):
    for value, derivative in zip(function[:-1], function[1:], strict=True):
        # differences are less exact at the ends and where a window has risen
        np.testing.assert_allclose(np.gradient(value, TIME)[1:-1], derivative[1:-1], atol=5e-3)


@pytest.mark.parametrize("harmonic", [1, 2, 5])
def test_a_weight_is_that_of_the_velocity_for_every_harmonic(harmonic):
    weights = np.zeros(2 * harmonic)
    weights[-2] = 0.3

    value, velocity, _ = fourier(TIME, 1.2, weights)

    assert np.abs(velocity).max() == pytest.approx(0.3 * 1.2, rel=1e-3)
    assert np.abs(value).max() == pytest.approx(0.3 / harmonic, rel=1e-3)


def test_a_window_is_at_rest_at_its_ends_and_open_between():
    np.testing.assert_allclose(WINDOW[:, [0, -1]], 0.0, atol=1e-12)
    between = (TIME > 2.0) & (TIME < 5.0)
    np.testing.assert_array_equal(WINDOW[:, between], np.eye(3)[:, :1] * np.ones(between.sum()))
