# SPDX-License-Identifier: BSD-3-Clause
"""Smooth functions of a signal."""

import numpy as np
import pytest

from skidyn.effects import Signals, Term, get_effect


@pytest.mark.parametrize(
    ("kind", "name", "torque"),
    [
        ("function_of_position", "q", lambda x: np.sin(7 * x)),
        ("function_of_velocity", "dq", lambda x: x * np.exp(-(x**2))),
    ],
)
def test_splines_follow_their_signal_and_no_other(signals, left_by, kind, name, torque):
    x = getattr(signals, name)[:, 0]
    columns = Term(kind, (1,), {"low": x.min(), "high": x.max()}).torque_columns(signals)[0]
    assert left_by(columns, torque(x)) < 0.01
    assert left_by(columns, np.sin(3 * signals.time)) > 0.5


def test_functions_of_a_velocity_continue_beyond_the_range_of_the_fit(signals):
    shape = {"of": ("dq1",), "low": (-0.5,), "high": (0.5,)}
    (columns,) = Term("function_of_signal", (2,), shape).torque_columns(signals).values()
    velocity = signals.dq[:, 0]
    inside = np.abs(velocity) < 0.5
    assert 0.1 < inside.mean() < 0.9
    found = np.linalg.lstsq(columns[inside], velocity[inside] ** 2)[0]
    beyond = columns[~inside] @ found
    # along the secant of the square over the outer parts of the range
    expected = 0.25 + (np.abs(velocity[~inside]) - 0.5) * 0.85
    np.testing.assert_allclose(beyond, expected, atol=1e-3)


@pytest.mark.parametrize(("n_trajectories", "top"), [(5, 1.0), (10, 0.5)])
def test_functions_cover_what_several_recordings_or_blocks_of_few_ones_reach(n_trajectories, top):
    """Two of them are fast; in a log of few, blocks are held out, of which four reach the top."""
    trajectory = np.repeat(np.arange(n_trajectories), 200)
    phase = np.tile(np.linspace(0, 4 * np.pi, 200), n_trajectories)
    dq = np.where(trajectory < 2, 1.0, 0.5)[:, None] * np.sin(phase)[:, None]
    signals = Signals(dq, dq, dq, trajectory=trajectory, time=0.01 * np.arange(len(dq)))
    shape = get_effect("function_of_signal").shape_of(signals, ("dq1",))
    np.testing.assert_allclose(shape["high"], top, atol=0.01)
