# SPDX-License-Identifier: BSD-3-Clause
"""Products of simple functions of signals."""

import numpy as np

from skidyn.effects import Factor, get_effect


def test_a_product_multiplies_its_functions_and_names_their_signals(signals):
    effect = get_effect("product_of_signals")
    factors = (Factor("q1", "side", 0.1), Factor("dq2", "size"), Factor("q1", "sin2"))
    shape = effect.shape_of(factors)
    q, dq = signals.q[:, 0], signals.dq[:, 1]
    expected = np.sign(q - 0.1) * np.abs(dq) * np.sin(2 * q)
    np.testing.assert_allclose(effect.columns(signals, 0, **shape)[:, 0], expected)
    assert effect.variables(0, shape) == ("q1", "dq2")


def test_the_direction_of_a_velocity_is_that_of_dry_friction(signals):
    effect = get_effect("product_of_signals")
    shape = effect.shape_of((Factor("dq2", "side"), Factor("ddq1", "value")))
    expected = signals.sign[:, 1] * signals.ddq[:, 0]
    np.testing.assert_allclose(effect.columns(signals, 0, **shape)[:, 0], expected)


def test_a_function_has_another_size_in_each_recording_and_none_in_others(signals):
    effect = get_effect("size_by_recording")
    names = np.unique(signals.trajectory)[:2].tolist()
    shape = effect.shape_of(Factor("q2", "value", 0.3), names)
    columns = effect.columns(signals, 0, **shape)
    assert columns.shape[1] == len(effect.coefficients_of(shape)) == len(names)
    for column, name in zip(columns.T, names, strict=True):
        here = signals.trajectory == name
        np.testing.assert_allclose(column[here], signals.q[here, 1] - 0.3)
        assert not column[~here].any()
    assert effect.variables(0, shape) == ("q2", "trajectory")


def test_a_product_with_the_load_is_one_of_the_own_joint(signals):
    effect = get_effect("product_with_load")
    factors = Factor("load", "size"), Factor("q2", "value", 0.3)
    column = effect.columns(signals, 0, **effect.shape_of(factors))[:, 0]
    np.testing.assert_allclose(column, np.abs(signals.load[:, 0]) * (signals.q[:, 1] - 0.3))
    assert effect.variables(0, effect.shape_of(factors)) == ("q2", "tau1")


def test_a_simple_function_times_a_free_one_of_another_signal(signals, left_by):
    effect = get_effect("product_with_function")
    shape = effect.shape_of(signals, Factor("dq2", "side"), ("q1",))
    columns = effect.columns(signals, 0, **shape)
    size = 2.0 + signals.q[:, 0] ** 2
    assert left_by(columns, size * signals.sign[:, 1]) < 0.01
    assert left_by(columns, size) > 0.3
    assert effect.variables(0, shape) == ("dq2", "q1")
    assert columns.shape[1] == len(effect.coefficients_of(shape)) == 8


def test_a_simple_function_times_a_free_one_of_two_signals(signals, left_by):
    effect = get_effect("product_with_function")
    shape = effect.shape_of(signals, Factor("q2", "value", 0.1), ("q1", "ddq2"))
    columns = effect.columns(signals, 0, **shape)
    expected = (signals.q[:, 1] - 0.1) * signals.q[:, 0] * signals.ddq[:, 1]
    assert left_by(columns, expected) < 0.01
    assert effect.variables(0, shape) == ("ddq2", "q1", "q2")
    assert columns.shape[1] == len(effect.coefficients_of(shape)) == 16
