# SPDX-License-Identifier: BSD-3-Clause
"""Nameless functions of signals of any joints, and of sums of positions."""

import numpy as np
import pytest

from skidyn.effects import get_effect


@pytest.mark.parametrize("names", [("q2",), ("q1", "dq2"), ("q1", "q2", "ddq2")])
def test_a_function_of_signals_follows_their_product_and_no_other(signals, left_by, names):
    count = {1: "signal", 2: "two_signals", 3: "three_signals"}[len(names)]
    effect = get_effect(f"function_of_{count}")
    shape = effect.shape_of(signals, names)
    assert effect.variables(0, shape) == names
    columns = effect.columns(signals, 0, **shape)
    assert left_by(columns, np.prod([signals.named(name) for name in names], axis=0)) < 0.01
    assert left_by(columns, np.sin(61 * signals.time)) > 0.5


def test_friction_over_two_signals_follows_one_velocity_and_two_others(signals, left_by):
    effect = get_effect("friction_over_two_signals")
    names = ("dq1", "q1", "q2")
    assert effect.admits(names)
    assert not effect.admits(("dq1", "dq2", "q1")) and not effect.admits(("dq1", "q1"))
    columns = effect.columns(signals, 0, **effect.shape_of(signals, names))
    load = 2.0 + signals.q[:, 0] * signals.q[:, 1]
    assert left_by(columns, load * signals.sign[:, 0]) < 1e-6
    assert left_by(columns, load) > 0.3


def test_a_function_of_a_sum_follows_no_other_sum(signals, left_by):
    effect = get_effect("function_of_sum")
    columns = effect.columns(signals, 0, **effect.shape_of(signals, (0, 1), (1.0, -1.0)))
    q = signals.q
    assert left_by(columns, np.sin(5 * (q[:, 0] - q[:, 1]))) < 0.01
    assert left_by(columns, np.sin(5 * (q[:, 0] + q[:, 1]))) > 0.5


def test_a_torque_between_two_joints_acts_on_both_by_its_ratio(signals):
    effect = get_effect("torque_between_two_joints")
    shape = effect.grid(signals, (0, 1))[0]
    columns = effect.torque_columns(signals, (0, 1), **shape)
    np.testing.assert_allclose(columns[1], shape["ratio"] * columns[0])
    other = {**shape, "passed": 2 * shape["ratio"]}
    assert effect.denies(get_effect("coupling_spring"), other)
    assert not effect.denies(get_effect("coupling_spring"), shape)
