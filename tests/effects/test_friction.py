# SPDX-License-Identifier: BSD-3-Clause
"""Columns of friction against their formulas."""

import numpy as np
import pytest

from skidyn.effects import Term, dahl_state, get_effect


def test_friction(signals, columns_of):
    v, sign = signals.dq[:, 0], np.sign(signals.dq[:, 0])
    fast = np.abs(v) > 0.02
    stribeck = columns_of("stribeck", signals, vs=0.1, delta=2.0)[:, 0]
    np.testing.assert_allclose(stribeck[fast], (sign * np.exp(-((v / 0.1) ** 2)))[fast], atol=1e-4)
    np.testing.assert_allclose(columns_of("coulomb", signals)[fast, 0], sign[fast], atol=1e-4)
    power = columns_of("nonlinear_viscous", signals, power=2.0)[:, 0]
    np.testing.assert_allclose(power, v * np.abs(v), atol=1e-4)
    np.testing.assert_array_equal(columns_of("asymmetric_friction", signals)[:, 0], np.abs(v))
    load = columns_of("load_dependent_friction", signals)[:, 0]
    np.testing.assert_allclose(load[fast], (np.abs(signals.load[:, 0]) * sign)[fast], atol=1e-4)
    lugre = columns_of("lugre", signals, presliding=0.02, vs=0.1)
    state = dahl_state(signals.q[:, 0], signals.segments, 0.02)
    expected = np.column_stack([state, state * np.exp(-((v / 0.1) ** 2))])
    np.testing.assert_allclose(lugre, expected)


def test_further_forms_have_other_powers(signals, columns_of):
    v, sign, load = signals.dq[:, 0], signals.sign[:, 0], np.abs(signals.load[:, 0])
    squared = columns_of("asymmetric_friction", signals, power=2.0)
    np.testing.assert_allclose(squared, np.column_stack([v**2, np.ones_like(v)]))
    root = columns_of("load_dependent_friction", signals, power=0.5)[:, 0]
    np.testing.assert_allclose(root, np.sqrt(load) * sign)


def test_stribeck_friction_may_fade_as_a_lorentz_curve(signals, columns_of):
    speed = np.abs(signals.dq[:, 0]) / 0.2
    fading = columns_of("stribeck", signals, vs=0.2, delta=2.0, lorentzian=1.0)[:, 0]
    np.testing.assert_allclose(fading, signals.sign[:, 0] / (1 + speed**2))


def test_dry_friction_may_turn_gradually(signals, columns_of):
    rounded = columns_of("coulomb", signals, rounding=0.1)[:, 0]
    np.testing.assert_allclose(rounded, np.tanh(signals.dq[:, 0] / 0.1))
    slower = columns_of("coulomb", signals, rounding=0.1, arctangent=1.0)[:, 0]
    np.testing.assert_allclose(slower, np.arctan(signals.dq[:, 0] / 0.1) * 2 / np.pi)


def test_friction_of_one_direction_alone(signals, columns_of):
    dq = signals.dq[:, 0]
    for side in (1.0, -1.0):
        columns = columns_of("asymmetric_friction", signals, power=2.0, side=side)
        np.testing.assert_allclose(columns[:, 0], np.where(side * dq > 0, dq**2, 0.0))


def test_friction_may_grow_up_to_a_speed(signals, columns_of):
    dq = signals.dq[:, 0]
    grown = 0.3 * (1 - np.exp(-np.abs(dq) / 0.3))
    columns = columns_of("nonlinear_viscous", signals, power=2.0, saturating=0.3)
    np.testing.assert_allclose(columns[:, 0], grown**2 * signals.sign[:, 0])
    columns = columns_of("asymmetric_friction", signals, saturating=0.3, side=-1.0)
    np.testing.assert_allclose(columns[:, 0], np.where(dq < 0, grown, 0.0))


def test_friction_that_saturates_does_not_fall_with_the_speed():
    """That would be Stribeck friction."""
    term = Term("nonlinear_viscous", (1,), {"power": 1.0, "saturating": 0.2})
    assert term.lowest[0] == 0 > Term("nonlinear_viscous", (1,), {"power": 2.0}).lowest[0]


@pytest.mark.parametrize("kind", ["stribeck", "lugre"])
def test_a_hump_over_much_of_the_speeds_is_no_friction_of_low_speed(signals, kind):
    effect, shape = get_effect(kind), {"presliding": 0.01, "delta": 2.0}
    highest = np.quantile(np.abs(signals.dq[:, 0]), 0.99)
    assert effect.admissible(signals, (0,), shape | {"vs": 0.2 * highest})
    assert not effect.admissible(signals, (0,), shape | {"vs": 0.4 * highest})
    slow = signals.with_(dq=1e-2 * signals.dq)
    assert len(effect.grid(slow, (0,))) == 1  # a model that asks for it can be fitted


def test_friction_may_grow_from_a_speed_on(signals, columns_of):
    dq = signals.dq[:, 0]
    churned = columns_of("nonlinear_viscous", signals, power=1.5, beyond=0.3)[:, 0]
    expected = np.maximum(np.abs(dq) - 0.3, 0.0) ** 1.5 * np.sign(dq)
    np.testing.assert_allclose(churned, expected, atol=1e-12)
    effect = get_effect("nonlinear_viscous")
    (shape,) = (s for s in effect.grid(signals, (0,)) if "beyond" in s)
    assert effect.admissible(signals, (0,), shape)
    assert not effect.admissible(signals, (0,), shape | {"beyond": np.abs(dq).max()})
