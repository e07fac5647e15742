# SPDX-License-Identifier: BSD-3-Clause
"""Delay, saturation and gain of a torque."""

import numpy as np
import pytest

from skidyn.effects import Term, get_effect


def test_delay_is_a_shift(signals):
    torque, delay = signals.model_torque, 0.004
    change = get_effect("time_delay").torque_columns(signals, (0, 1))
    shifted = np.sin(3 * (signals.time - delay))
    inner = np.r_[2:298, 302:598]
    np.testing.assert_allclose(
        (torque[:, 0] + delay * change[0][:, 0])[inner], shifted[inner], atol=2e-4
    )


def test_saturation_and_gain(signals, columns_of):
    torque = signals.model_torque[:, 0]
    cut = torque + columns_of("saturation", signals, limit=0.6)[:, 0]
    np.testing.assert_allclose(cut, np.clip(torque, -0.6, 0.6))
    np.testing.assert_array_equal(columns_of("torque_gain", signals)[:, 0], torque)
    positive = columns_of("torque_gain", signals, sign=1.0)[:, 0]
    np.testing.assert_array_equal(positive, np.maximum(torque, 0))
    negative = columns_of("torque_gain", signals, sign=-1.0)[:, 0]
    np.testing.assert_array_equal(negative, np.minimum(torque, 0))


def test_a_rounded_limit_is_approached(signals, columns_of):
    torque = signals.model_torque[:, 0]
    missing = columns_of("saturation", signals, limit=0.8, rounding=1.0)[:, 0]
    np.testing.assert_allclose(torque + missing, 0.8 * np.tanh(torque / 0.8))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_limit_on_one_side_leaves_the_other_alone(signals, columns_of, side):
    torque = signals.model_torque[:, 0]
    cut = torque + columns_of("saturation", signals, limit=0.4, side=side)[:, 0]
    expected = np.minimum(torque, 0.4) if side > 0 else np.maximum(torque, -0.4)
    np.testing.assert_allclose(cut, expected)


def test_limits_of_both_directions_may_differ(signals, columns_of):
    torque = signals.model_torque[:, 0]
    missing = columns_of("saturation", signals, limit=0.7, limit_below=0.4)
    np.testing.assert_allclose(torque + missing[:, 0], np.clip(torque, -0.4, 0.7))
    effect = get_effect("saturation")
    shapes = [s for s in effect.grid(signals, (0,)) if "limit_below" in s]
    assert shapes
    assert all(set(effect.parameters(np.ones(1), s)) <= set(effect.units()) for s in shapes)


def test_a_long_delay_is_a_difference_from_an_earlier_torque(signals):
    shift, torque = 0.06, signals.model_torque
    change = get_effect("time_delay").torque_columns(signals, (0, 1), shift=shift)
    shifted = np.sin(3 * (signals.time - shift))
    inner = np.r_[20:300, 320:600]
    late = torque[:, 0] + shift * change[0][:, 0]
    np.testing.assert_allclose(late[inner], shifted[inner], atol=2e-4)
    short = get_effect("time_delay").torque_columns(signals, (0,), shift=1e-3)[0]
    plain = get_effect("time_delay").torque_columns(signals, (0,))[0]
    np.testing.assert_allclose(short[inner], plain[inner], atol=0.05)  # of one step


def test_a_gain_may_change_with_the_speed(signals):
    effect = get_effect("torque_gain")

    found = effect.columns(signals, 1, over_speed=1.0) @ [0.1, -0.02]

    factor = 0.1 - 0.02 * np.abs(signals.dq[:, 1])
    np.testing.assert_allclose(found, factor * signals.model_torque[:, 1])
    names = [c.name for c in effect.coefficients_of({"over_speed": 1.0})]
    assert [effect.units()[name] for name in names] == ["1", "s/rad"]


def test_a_gain_may_change_with_the_torque(signals):
    effect = get_effect("torque_gain")

    found = effect.columns(signals, 1, over_torque=1.0) @ [0.1, -0.02]

    torque = signals.model_torque[:, 1]
    np.testing.assert_allclose(found, (0.1 - 0.02 * np.abs(torque)) * torque)
    names = [c.name for c in effect.coefficients_of({"over_torque": 1.0})]
    assert [effect.units()[name] for name in names] == ["1", "1/(N m)"]


def test_a_gain_may_differ_at_small_torques(signals):
    effect = get_effect("torque_gain")
    (shape,) = (s for s in effect.grid(signals, [1]) if "near_zero" in s)

    found = effect.columns(signals, 1, **shape) @ [0.1, -0.2]

    torque = signals.model_torque[:, 1]
    factor = 0.1 - 0.2 * np.exp(-np.abs(torque) / shape["near_zero"])
    np.testing.assert_allclose(found, factor * torque)
    names = [c.name for c in effect.coefficients_of(shape)]
    assert names == ["epsilon", "epsilon_zero"]
    assert not effect.has_shape


def test_a_limit_does_not_cut_off_more_than_is_beyond():
    term = Term.at("saturation", (0,), {"limit": 2.0})
    assert 1.0 < term.limits[0] < 1.4
