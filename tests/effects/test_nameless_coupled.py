# SPDX-License-Identifier: BSD-3-Clause
"""Nameless torques of other joints and of what swings, against formulas of their own."""

import numpy as np
from scipy.integrate import solve_ivp

from skidyn.effects import get_effect


def test_a_gyroscopic_couple_takes_no_energy(signals):
    columns = get_effect("gyroscopic_couple").torque_columns(signals, (0, 1), other=1)
    power = sum(columns[j][:, 0] * signals.dq[:, j] for j in (0, 1))
    np.testing.assert_allclose(power, 0.0, atol=1e-12)
    np.testing.assert_array_equal(columns[0][:, 0], signals.dq[:, 1])


def test_crosstalk_is_the_torque_of_the_other_joint(signals):
    effect = get_effect("crosstalk")
    shapes = effect.grid(signals, (0,))
    assert [effect.variables(0, shape) for shape in shapes] == [("tau2",)]
    np.testing.assert_array_equal(
        effect.columns(signals, 0, **shapes[0])[:, 0], signals.model_torque[:, 1]
    )


def test_a_function_of_the_torque_of_another_joint_has_its_unit(signals):
    effect = get_effect("function_of_other_torque")
    (shape,) = effect.grid(signals, (0,))
    assert effect.variables(0, shape) == ("tau2",)
    torque = signals.model_torque[:, 1]
    bent = 0.3 * torque * np.abs(torque)
    columns = effect.columns(signals, 0, **shape)
    left = bent - columns @ np.linalg.lstsq(columns, bent, rcond=None)[0]
    np.testing.assert_allclose(left, 0.0, atol=1e-9 * np.abs(bent).max())
    twice = signals.with_(model_torque=2 * signals.model_torque)
    (own,) = effect.grid(twice, (0,))
    np.testing.assert_allclose(effect.columns(twice, 0, **own), columns)


def test_friction_over_the_load_of_another_joint_names_both(signals):
    effect = get_effect("friction_over_other_load")
    (shape,) = effect.grid(signals, (0,))
    assert effect.variables(0, shape) == ("dq1", "tau2")
    columns = effect.columns(signals, 0, **shape)
    load = np.abs(signals.load[:, 1]) / shape["size"]
    np.testing.assert_allclose(columns[:, 1], load**2 * signals.sign[:, 0])


def test_what_swings_follows_its_equation_of_motion(signals):
    frequency, damping = 1.2, 0.1
    omega = 2 * np.pi * frequency
    rows = signals.segments[0]
    clock, ddq = signals.clock[rows], signals.ddq[rows, 0]

    def slope(t, state):
        pushed = np.interp(t, clock, ddq)
        return [state[1], -2 * damping * omega * state[1] - omega**2 * state[0] - pushed]

    path = solve_ivp(slope, clock[[0, -1]], [0.0, 0.0], t_eval=clock, rtol=1e-8, atol=1e-10).y
    effect = get_effect("swinging_load")
    columns = effect.columns(signals, 0, frequency=frequency, damping=damping)[rows]
    expected = np.column_stack([omega**2 * path[0], omega * path[1]])
    np.testing.assert_allclose(columns, expected, atol=0.01 * np.abs(expected).max())
