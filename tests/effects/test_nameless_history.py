# SPDX-License-Identifier: BSD-3-Clause
"""Columns of nameless torques that follow history or the place of the tool."""

import numpy as np
import pytest

from skidyn.effects import Term, get_effect


@pytest.mark.parametrize("kind", ["function_of_lagging_position", "function_of_lagging_velocity"])
def test_a_switch_is_a_function_of_the_position_with_play(signals, kind):
    x = (signals.q if kind.endswith("position") else signals.dq)[:, 0]
    play, state = 0.2, np.zeros(len(x))
    for rows in signals.segments:
        at = 0.0
        for i in range(rows.start, rows.stop):
            at = np.sign(x[i]) if abs(x[i]) > play else at
            state[i] = at
    shape = {"play": play, "low": x.min(), "high": x.max()}
    columns = get_effect(kind).columns(signals, 0, **shape)
    known = state != 0
    left = state - columns @ np.linalg.lstsq(columns[known], state[known], rcond=None)[0]
    assert np.mean(left[known] ** 2) < 0.05  # splines round the edge


def test_what_relaxes_follows_the_position_and_fades(signals):
    rest = signals.with_(q=np.where(np.arange(600) % 300 < 100, 0.0, 0.5)[:, None] * np.ones(2))
    columns = get_effect("relaxing_spring").columns(rest, 0)
    assert np.all(np.abs(columns[:100]) < 1e-12)
    since = rest.time[120] - rest.time[100]
    for column, time_constant in zip(columns.T, (0.1, 0.3, 1.0, 3.0), strict=True):
        expected = 0.5 * np.exp(-since / time_constant)
        assert column[120] == pytest.approx(expected, rel=0.06)


def test_a_drag_takes_energy_from_the_tool(signals, robot):
    position = robot.forward_kinematics(signals.q)[0][:, 2]
    shape = {"low": position.min() - 0.01, "high": position.max() + 0.01}
    term = Term("drag_on_tool", (1, 2), shape)
    columns = term.torque_columns(signals)
    power = sum(c.sum(axis=1) * signals.dq[:, j] for j, c in columns.items())
    jacobian = robot.jacobian(signals.q)[:, :3]
    velocity = np.einsum("ian,in->ia", jacobian, signals.dq)
    np.testing.assert_allclose(power, np.sum(velocity**2, axis=1), atol=1e-9)


def test_a_drift_over_the_log_needs_several_recordings_and_stays_beyond_it(signals):
    effect = get_effect("function_of_time")
    assert "too few recordings" in effect.not_shown(signals, 0)
    (shape,) = effect.grid(signals, (0,))
    columns = effect.columns(signals, 0, **shape)
    np.testing.assert_allclose(columns[[0, -1], 1], [-1.0, 1.0])
    later = effect.columns(signals, 0, low=shape["low"], high=shape["low"] + 1.0)
    assert np.all(later[signals.clock > shape["low"] + 1.0] == later[-1])


def test_an_offset_that_sets_in_stays_and_is_called_by_its_moment(signals):
    effect = get_effect("sudden_offset")
    grid = effect.grid(signals, (0,))
    assert all(effect.admissible(signals, (0,), shape) for shape in grid)
    moment = grid[len(grid) // 2]["moment"]
    column = effect.columns(signals, 0, moment=moment)[:, 0]
    np.testing.assert_array_equal(column, signals.clock >= moment)
    assert f"{moment:.6g} s" in effect.words({"moment": moment})
