# SPDX-License-Identifier: BSD-3-Clause
"""Ranges of shape parameters."""

import numpy as np
import pytest

from skidyn.effects import get_effect


def range_of(kind, name, signals, joint=0):
    (shape,) = (shape for shape in get_effect(kind).shapes if shape.name == name)
    return shape.range_on(signals, joint)


def test_a_slider_that_travels_far_has_larger_velocities_and_distances(signals):
    slides = np.ones(signals.n_joints, dtype=bool)
    short = signals.with_(prismatic=slides, q=0.05 * signals.q)
    far = signals.with_(prismatic=slides, q=8.0 * signals.q)
    low, high = range_of("stribeck", "vs", signals)
    assert range_of("stribeck", "vs", short) == pytest.approx((0.1 * low, 0.1 * high))
    assert range_of("stribeck", "vs", far) == pytest.approx((0.1 * low, 4.0 * high), rel=0.01)


def test_numbers_without_a_length_are_the_same_for_sliders(signals):
    slides = np.ones(signals.n_joints, dtype=bool)
    far = signals.with_(prismatic=slides, q=8.0 * signals.q)
    assert range_of("stribeck", "delta", far) == range_of("stribeck", "delta", signals)
