# SPDX-License-Identifier: BSD-3-Clause
"""Columns of nameless torques that depend on history."""

import numpy as np
import pytest

from skidyn.effects import get_effect


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


def test_a_drift_over_the_log_needs_several_recordings_and_stays_beyond_it(signals):
    effect = get_effect("function_of_time")
    assert "too few recordings" in effect.not_shown(signals, 0)
    (shape,) = effect.grid(signals, (0,))
    columns = effect.columns(signals, 0, **shape)
    np.testing.assert_allclose(columns[[0, -1], 1], [-1.0, 1.0])
    later = effect.columns(signals, 0, low=shape["low"], high=shape["low"] + 1.0)
    assert np.all(later[signals.clock > shape["low"] + 1.0] == later[-1])


def test_an_oscillation_since_the_start_begins_anew_in_every_recording(signals):
    effect = get_effect("oscillation_since_start")
    columns = effect.columns(signals, 0, frequency=1.5, decay=0.8)
    assert effect.variables(0, {}) == ("time",)
    for rows in signals.segments:
        since = signals.clock[rows] - signals.clock[rows][0]
        swing = np.exp(-since / 0.8) * np.exp(2j * np.pi * 1.5 * since)
        np.testing.assert_allclose(columns[rows], np.column_stack([swing.real, swing.imag]))


def test_an_offset_that_sets_in_stays_and_is_called_by_its_moment(signals):
    effect = get_effect("sudden_offset")
    grid = effect.grid(signals, (0,))
    assert all(effect.admissible(signals, (0,), shape) for shape in grid)
    moment = grid[len(grid) // 2]["moment"]
    column = effect.columns(signals, 0, moment=moment)[:, 0]
    np.testing.assert_array_equal(column, signals.clock >= moment)
    assert f"{moment:.6g} s" in effect.words({"moment": moment})


def test_what_remembers_a_reversal_keeps_its_torque_until_the_next_one(signals):
    fading = signals.with_(q=signals.q * np.exp(-0.2 * signals.time)[:, None])
    effect = get_effect("function_of_last_reversal")
    shapes = effect.grid(fading, (0,))
    assert [shape["other"] for shape in shapes] == [0, 1]
    assert effect.variables(0, {"other": 1}) == ("q2", "dq2")
    columns = effect.columns(fading, 0, **shapes[1])
    # the function is the same on other motion
    half = effect.columns(fading.take(slice(0, 150)), 0, **shapes[1])
    np.testing.assert_allclose(half, columns[:150])
    direction = np.sign(np.diff(fading.q[:, 1]))
    same = (direction[1:] == direction[:-1]) & (np.diff(fading.trajectory)[1:] == 0)
    changed = np.abs(columns[2:] - columns[1:-1]).max(axis=1) > 1e-9
    assert not changed[same].any()
    assert changed.sum() >= 3


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        ("function_of_way_since_reversal", ("q2", "dq2")),
        ("function_of_time_since_reversal", ("dq2", "time")),
        ("relaxing_spring", ("q2", "dq2")),
    ],
)
def test_a_torque_may_remember_the_motion_of_any_joint(signals, kind, names):
    effect = get_effect(kind)
    assert [shape["other"] for shape in effect.grid(signals, (0,))] == [0, 1]
    assert effect.variables(0, {"other": 1}) == names
    of_other = effect.columns(signals, 0, other=1)
    np.testing.assert_array_equal(of_other, effect.columns(signals, 1, other=1))
    assert not np.allclose(of_other, effect.columns(signals, 0, other=0))


def test_what_fades_after_a_reversal_begins_anew_at_the_next_one(signals):
    columns = get_effect("function_of_time_since_reversal").columns(signals, 0, other=1)
    slow = columns[:, 2]  # the slowest one, without the direction
    turns = np.flatnonzero(np.diff(np.sign(np.diff(signals.q[:, 1])))) + 1
    inside = [i for i in turns if len(np.unique(signals.trajectory[i - 2 : i + 3])) == 1]
    assert inside
    for i in inside:
        assert slow[i + 1] > slow[i - 1]
        assert slow[i + 1] > 0.95


def test_friction_after_motion_needs_both_motions(signals):
    effect = get_effect("friction_after_motion")
    assert effect.variables(0, {"other": 1}) == ("dq1", "dq2")
    still = signals.with_(dq=signals.dq * [1.0, 0.0])
    assert (effect.columns(still, 0, other=1) == 0).all()
    # what a joint warmed cools after it has come to rest
    stops = signals.with_(dq=signals.dq * [[1.0, 1.0]] * (signals.time < 2.0)[:, None] + [1e-3, 0])
    warmed = np.abs(effect.columns(stops, 0, other=1)[:, 0] / stops.dq[:, 0])
    assert warmed[299] < 0.2 * warmed[199]


def test_a_cover_remembers_how_far_a_joint_has_been(signals):
    effect = get_effect("torque_of_largest_position")
    columns = effect.columns(signals, 0, other=1)
    assert (columns >= 0).all()
    first = slice(0, 300)
    q = signals.q[first, 1]
    largest = np.array([q[: i + 1].max() for i in range(300)])
    np.testing.assert_allclose(columns[first, 0], largest - q)
    assert (columns[300] == 0).all()  # every recording begins anew


def test_a_sensor_that_lags_its_load_is_a_hysteresis_of_the_torque(signals):
    effect = get_effect("hysteresis_over_load")
    (shape,) = effect.grid(signals, (0,))
    assert effect.variables(0, shape) == ("tau1",)
    columns = effect.columns(signals, 0, **shape)
    torque, play = signals.model_torque[:, 0], 0.1 * shape["range"]
    lagging = np.zeros(600)
    for rows in signals.segments:
        at = torque[rows.start]
        for i in range(rows.start, rows.stop):
            at = min(max(at, torque[i] - play), torque[i] + play)
            lagging[i] = at
    np.testing.assert_allclose(torque - lagging, play * columns[:, 1], atol=1e-9)


def test_a_torque_of_recent_motion_remains_after_it(signals):
    effect = get_effect("torque_of_recent_motion")
    assert effect.variables(0, {"other": 1}) == ("dq2",)
    stops = signals.with_(dq=signals.dq * (signals.time < 2.0)[:, None])
    columns = effect.columns(stops, 0, other=1)
    assert (columns >= 0).all()
    assert (columns[199:299] > 0).all()
    assert (np.diff(columns[202:299], axis=0) < 0).all()
