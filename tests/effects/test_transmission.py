# SPDX-License-Identifier: BSD-3-Clause
"""What lies between motor and link: how a link swings, and what only looks like it."""

import numpy as np
import pytest

from skidyn.effects import Signals, Term, get_effect, list_effects, nameless_kinds


def test_derivatives_of_a_swing_are_those_of_its_way_up_to_fast_swings(signals):
    effect = get_effect("joint_elasticity")
    rows = max(signals.segments, key=lambda part: part.stop - part.start)
    frequency = 12.0
    load = np.zeros_like(signals.q)
    load[:, 0] = np.sin(2 * np.pi * frequency * signals.clock)

    way, speed, acceleration = effect.moves(
        signals.with_(load=load), 0, resonance=10.0, damping=0.2
    )

    settled = slice(rows.start + (rows.stop - rows.start) // 2, rows.stop)
    omega = 2 * np.pi * frequency
    step = float(np.median(np.diff(signals.clock[rows])))
    # Tustin's substitution differentiates as if the frequency were this one.
    warped = 2 / step * np.tan(omega * step / 2)
    np.testing.assert_allclose(
        acceleration[settled], -(warped**2) * way[settled], atol=0.02 * np.ptp(acceleration)
    )
    assert np.std(speed[settled]) == pytest.approx(warped * np.std(way[settled]), rel=0.02)


def test_a_spring_is_not_stiffer_than_its_swing_says():
    shape = {"resonance": 5.0, "damping": 0.1, "inertia": 2.0, "share": 0.5}
    term = Term("joint_elasticity", (1,), shape)

    stiffness = 2.0 * (2 * np.pi * 5.0) ** 2
    assert term.lowest == pytest.approx([0.5 / stiffness])


def test_a_play_is_as_large_as_the_times_of_its_crossings_say():
    term = Term("backlash", (1,), get_effect("backlash").bounded(None, [0], {"gap": 0.004}, 0.5))
    assert list(term.lowest) == [0.5]
    assert list(Term("backlash", (1,), {"gap": 0.004}).lowest) == [0.0]


def test_a_swing_is_as_fast_as_the_inertia_of_the_link_in_its_pose(signals, robot):
    effect = get_effect("joint_elasticity")
    rows = max(signals.segments, key=lambda part: part.stop - part.start)
    middle = (rows.start + rows.stop) // 2
    halves = slice(rows.start + 1, middle), slice(middle, rows.stop)
    still, load = np.zeros_like(signals.q), np.zeros_like(signals.q)
    load[rows.start + 1 : rows.stop, 0] = 1.0  # it leaps, and the link rings
    bent = still.copy()
    bent[halves[1], 1] = 2.5
    posed = signals.with_(q=bent, dq=still, ddq=still, load=load)

    way, _, acceleration = effect.moves(posed, 0, resonance=6.0, damping=0.001)

    squares = [np.polyfit(way[half] - 1.0, -acceleration[half], 1)[0] for half in halves]
    inertia = robot.mass_matrix(np.array([[0.0, 0.0], [0.0, 2.5]]))[:, 0, 0]
    assert squares[1] / squares[0] == pytest.approx(inertia[0] / inertia[1], rel=0.02)


def test_the_inertia_that_bounds_a_compliance_is_that_of_the_link(signals, robot):
    effect = get_effect("joint_elasticity")

    shape = effect.bounded(signals, [1], {"resonance": 5.0, "damping": 0.1}, 0.5)

    last = robot.mass_matrix(np.zeros((1, 2)))[0, 1, 1]
    bound = {"inertia": pytest.approx(last), "share": 0.5}
    assert shape == {"resonance": 5.0, "damping": 0.1} | bound


def test_what_must_not_be_negative_may_be_as_small_as_it_likes():
    assert list(Term("coulomb", (1,)).lowest) == [0.0]
    assert list(Term("offset", (1,)).lowest) == [-np.inf]


def test_noise_of_the_acceleration_is_neither_a_name_nor_a_function_to_try():
    assert "acceleration_noise" not in list_effects()
    assert "acceleration_noise" not in nameless_kinds()


def test_noise_of_the_acceleration_reaches_all_joints_and_leaves_the_motion_alone(signals):
    effect = get_effect("acceleration_noise")
    noise = 0.1 * np.random.default_rng(0).normal(size=signals.ddq.shape)

    quiet = effect.torque_columns(signals, [0])
    noisy = effect.torque_columns(signals.with_(ddq=signals.ddq + noise), [0])

    assert set(noisy) == {0, 1}
    for joint, column in noisy.items():
        assert np.std(quiet[joint]) < 0.1 * np.std(column)


def test_a_swing_asks_for_motion_as_fast_as_itself_and_a_spring_for_none():
    assert get_effect("joint_elasticity").fastest({"resonance": 12.0}) == 12.0
    assert get_effect("spring").fastest({}) == 0.0


def test_a_play_below_the_steps_of_the_sensors_is_a_remark():
    rng = np.random.default_rng(0)
    q = np.round(rng.uniform(-1, 1, (500, 2)) / 2e-3) * 2e-3
    signals = Signals(q, q, q, trajectory=np.zeros(500, dtype=int))
    backlash = get_effect("backlash")

    assert "less than a step" in backlash.too_small({"gap": (1e-3, 8e-4, 1.2e-3)}, signals)
    assert backlash.too_small({"gap": (3e-3, 2e-3, 4e-3)}, signals) is None
    fine = signals.with_(q=rng.uniform(-1, 1, (500, 2)))
    assert backlash.too_small({"gap": (1e-3, 8e-4, 1.2e-3)}, fine) is None
