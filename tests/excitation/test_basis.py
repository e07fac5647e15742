# SPDX-License-Identifier: BSD-3-Clause
"""Functions of which designed motions are sums."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.excitation import design_excitation

SECONDS = 8.0


@pytest.fixture(scope="module", params=["fourier", "quintic"])
def motion(request):
    words = {"base_frequency": 0.25, "harmonics": 3, "points": 3, "blend": 1.0}
    excitation = design_excitation(
        load_planar_arm(), motion=request.param, duration=SECONDS, iterations=2, **words
    )
    return request.param, excitation.sample(100.0)


def left(columns, values):
    """Largest part of values that is no sum of columns."""
    return np.abs(values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]).max()


def test_between_the_blends_or_points_there_is_nothing_else(motion):
    """Harmonics of the base frequency, or one polynomial of degree five between two points."""
    kind, (time, q, _, _) = motion
    if kind == "fourier":
        middle = (time > 1.0) & (time < SECONDS - 1.0)
        angle = 2 * np.pi * 0.25 * time[middle, None] * np.arange(1, 4)
        columns = np.column_stack([np.ones(middle.sum()), np.sin(angle), np.cos(angle)])
        assert left(columns, q[middle]) < 1e-9
        assert left(columns[:, [0, 1, 2, 4, 5]], q[middle]) > 1e-4
        return
    for k in range(4):
        part = (time >= 2.0 * k) & (time <= 2.0 * (k + 1))
        columns = np.vander((time[part] - 2.0 * k - 1.0), 6)
        assert left(columns, q[part]) < 1e-9
        assert left(columns[:, 1:], q[part]) > 1e-6


def test_a_motion_starts_and_ends_at_rest_in_the_same_place(motion):
    _, (_, q, dq, ddq) = motion
    for state in (q - q[0], dq, ddq):
        np.testing.assert_allclose(state[[0, -1]], 0.0, atol=1e-9)
