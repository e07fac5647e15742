# SPDX-License-Identifier: BSD-3-Clause
"""States of hysteresis against formulas written step by step."""

import numpy as np
import pytest

from skidyn.effects import dahl_state, get_effect, stop_state


def test_dahl_by_small_steps(signals):
    q, way = signals.q[:, 0], 0.05
    expected = np.zeros(len(q))
    for rows in signals.segments:
        state = 0.0
        for i in range(rows.start + 1, rows.stop):
            step = (q[i] - q[i - 1]) / 200
            for _ in range(200):
                state += step / way * (1 - state * np.sign(step))
            expected[i] = state
    np.testing.assert_allclose(dahl_state(q, signals.segments, way), expected, atol=2e-3)
    assert expected[300] == dahl_state(q, signals.segments, way)[300] == 0


def test_stop_operator_step_by_step(signals, columns_of):
    q, way = signals.q[:, 1], 0.04
    expected = np.zeros(len(q))
    for rows in signals.segments:
        for i in range(rows.start + 1, rows.stop):
            expected[i] = np.clip(expected[i - 1] + (q[i] - q[i - 1]) / way, -1, 1)
    np.testing.assert_allclose(stop_state(q, signals.segments, way), expected, atol=1e-12)
    block = columns_of("maxwell_slip", signals, 1, presliding=way)
    np.testing.assert_allclose(block[:, 0], expected, atol=1e-12)
    np.testing.assert_array_equal(block[:, 1], stop_state(q, signals.segments, way / 2))


def test_a_rest_does_not_break_a_stroke():
    q = np.array([0.0, 0.0, 0.1, 0.1, 0.3, 0.3, 0.2])
    np.testing.assert_allclose(
        stop_state(q, [slice(0, 7)], 0.4), [0, 0, 0.25, 0.25, 0.75, 0.75, 0.5]
    )


@pytest.mark.parametrize("exponent", [0.7, 1.6, 2.0])
def test_dahl_with_another_exponent_by_small_steps(signals, columns_of, exponent):
    q, way = signals.q[:, 0], 0.05
    expected = np.zeros(len(q))
    for rows in signals.segments:
        state = 0.0
        for i in range(rows.start + 1, rows.stop):
            step = (q[i] - q[i - 1]) / 200
            for _ in range(200):
                state += step / way * max(1 - state * np.sign(step), 0.0) ** exponent
            expected[i] = state
    found = columns_of("dahl", signals, presliding=way, exponent=exponent)[:, 0]
    np.testing.assert_allclose(found, expected, atol=5e-3)


def test_maxwell_elements_resist_the_motion_once_all_of_them_slip(signals):
    effect, shape = get_effect("maxwell_slip"), {"presliding": 0.02}
    assert effect.can_have(np.array([0.1, -0.02, 0.3]), shape, signals)
    assert not effect.can_have(np.array([0.1, -0.2, -0.1]), shape, signals)


def test_maxwell_elements_of_a_wider_spread_slip_later(signals):
    effect = get_effect("maxwell_slip")
    plain = effect.columns(signals, 0, presliding=0.02)
    wide = effect.columns(signals, 0, presliding=0.02, spread=5.0)
    np.testing.assert_array_equal(plain[:, 0], wide[:, 0])
    np.testing.assert_array_equal(wide[:, 2], effect.columns(signals, 0, presliding=0.1)[:, 0])
