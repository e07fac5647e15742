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


def test_functions_of_signals_keep_their_value_beyond_the_range_of_the_fit(signals):
    knots = (tuple(np.linspace(-0.5, 0.5, 20)),)
    shape = {"of": ("dq1",), "knots": knots}
    (columns,) = Term("function_of_signal", (2,), shape).torque_columns(signals).values()
    velocity = signals.dq[:, 0]
    inside = np.abs(velocity) < 0.5
    assert 0.1 < inside.mean() < 0.9
    found = np.linalg.lstsq(columns[inside], velocity[inside] ** 2)[0]
    np.testing.assert_allclose(columns[~inside] @ found, 0.25, atol=2e-3)


def test_a_joint_that_mostly_rests_leaves_knots_where_it_moves():
    time = 0.01 * np.arange(4000)
    q = np.where(time < 36.0, 0.0, np.sin(2 * time))[:, None]
    signals = Signals(q, q, q, trajectory=np.arange(4000) // 500, time=time)
    ((knots,),) = [get_effect("function_of_signal").shape_of(signals, ("q1",))["knots"]]
    away = np.asarray(knots)[np.abs(knots) > 1e-6]
    assert np.all(np.diff(knots) > 0)
    assert np.ptp(away) > 0.6 * np.ptp(q)


@pytest.mark.parametrize(("n_trajectories", "top"), [(5, 1.0), (10, 0.5)])
def test_functions_cover_what_several_recordings_or_blocks_of_few_ones_reach(n_trajectories, top):
    """Two of them are fast; in a log of few, blocks are held out, of which four reach the top."""
    trajectory = np.repeat(np.arange(n_trajectories), 200)
    phase = np.tile(np.linspace(0, 4 * np.pi, 200), n_trajectories)
    dq = np.where(trajectory < 2, 1.0, 0.5)[:, None] * np.sin(phase)[:, None]
    signals = Signals(dq, dq, dq, trajectory=trajectory, time=0.01 * np.arange(len(dq)))
    shape = get_effect("function_of_signal").shape_of(signals, ("dq1",))
    np.testing.assert_allclose(shape["knots"][0][-1], top, atol=0.01)
