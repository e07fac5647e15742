# SPDX-License-Identifier: BSD-3-Clause
"""Effects of two joints on each other."""

import numpy as np
import pytest

from skidyn.datasets import load_scara
from skidyn.effects import Signals, get_effect


def test_couplings_act_on_both_joints(signals):
    for kind, state in (("coupled_inertia", signals.ddq), ("coupling_spring", signals.q)):
        blocks = get_effect(kind).torque_columns(signals, (0, 1), ratio=-2.0)
        x = state[:, 0] - 2 * state[:, 1]
        np.testing.assert_allclose(blocks[0][:, 0], x)
        np.testing.assert_allclose(blocks[1], -2 * blocks[0])


def test_a_slider_and_a_rotary_joint_can_be_coupled():
    slides = np.array([kind == "prismatic" for kind in load_scara().joint_types])
    zero = np.zeros((3, 4))
    scara = Signals(zero, zero, zero, trajectory=np.zeros(3), prismatic=slides)
    spring = get_effect("coupling_spring")
    assert (2, 3) in spring.sites(scara)
    travel = zero + np.array([[0.0], [1.0], [3.0]])
    far = Signals(travel, zero, zero, trajectory=np.zeros(3), prismatic=slides)
    for shape in spring.grid(far, (1, 2)):  # with a ratio of 100, the hyperbolic sine overflows
        assert np.abs(spring.torque_columns(far, (1, 2), **shape)[1]).max() < 1e20
    for pair, expected in (((2, 3), (0.01, 0.1, 1.0)), ((0, 1), (1.0,))):
        ratios = sorted({abs(shape["ratio"]) for shape in spring.grid(scara, pair)})
        assert ratios == pytest.approx(expected)


def test_a_spring_between_two_joints_that_stiffens(signals):
    shape = {"ratio": -1.0, "power": 3.0, "x0": 0.2}
    blocks = get_effect("coupling_spring").torque_columns(signals, (0, 1), **shape)
    x = signals.q[:, 0] - signals.q[:, 1] - 0.2
    np.testing.assert_allclose(blocks[0], np.column_stack([x**3, np.ones_like(x)]))
    np.testing.assert_allclose(blocks[1], -blocks[0])


@pytest.mark.parametrize(("form", "curve"), [("stiffening", np.sinh), ("softening", np.tanh)])
def test_a_spring_between_two_joints_that_stiffens_or_yields_beyond_a_distance(
    form, curve, signals
):
    shape = {"ratio": -1.0, "x0": 0.2, form: 0.5}
    columns = get_effect("coupling_spring").torque_columns(signals, (0, 1), **shape)
    x = signals.q[:, 0] - signals.q[:, 1] - 0.2
    np.testing.assert_allclose(columns[0][:, 0], 0.5 * curve(x / 0.5))
    np.testing.assert_allclose(columns[1], -columns[0])


def test_where_a_spring_between_two_joints_is_slack_was_seen(signals):
    effect, x = get_effect("coupling_spring"), signals.q.sum(axis=1)
    shape = {"ratio": 1.0, "power": 3.0}
    assert effect.admissible(signals, (0, 1), {**shape, "x0": float(np.median(x))})
    assert not effect.admissible(signals, (0, 1), {**shape, "x0": float(x.max()) + 0.1})
    assert effect.admissible(signals, (0, 1), {"ratio": 1.0})


def test_coupled_drag_may_grow_with_a_power_of_the_speed(signals):
    columns = get_effect("coupled_friction").torque_columns(signals, (0, 1), ratio=1.0, power=2.0)
    speed = signals.dq.sum(axis=1)
    np.testing.assert_allclose(columns[0][:, 1], speed * np.abs(speed))


def test_the_dry_part_of_coupled_friction_may_be_rounded(signals):
    columns = get_effect("coupled_friction").torque_columns(
        signals, (0, 1), ratio=-1.0, rounding=0.3
    )
    speed = signals.dq[:, 0] - signals.dq[:, 1]
    np.testing.assert_allclose(columns[0], np.column_stack([np.tanh(speed / 0.3), speed]))


def test_further_forms_of_sliders_begin_in_their_units(signals):
    slides = signals.with_(prismatic=np.ones(signals.n_joints, dtype=bool))
    unit = float(slides.unit[0])
    for kind, name, value in (
        ("coupled_friction", "rounding", 0.2),
        ("coupling_spring", "stiffening", 0.4),
    ):
        (start,) = {s[name] for s in get_effect(kind).grid(slides, (0, 1)) if name in s}
        assert start == pytest.approx(value * unit) and unit != 1


def test_a_differential_has_a_shaft_for_the_sum_and_one_for_the_difference(signals):
    effect = get_effect("coupled_friction")
    both = effect.torque_columns(signals, (0, 1), ratio=1.0, differential=1.0)
    one = effect.torque_columns(signals, (0, 1), ratio=1.0)
    other = effect.torque_columns(signals, (0, 1), ratio=-1.0)
    for joint in (0, 1):
        np.testing.assert_allclose(both[joint], one[joint] + other[joint])


def test_the_shafts_of_a_differential_may_have_unequal_friction(signals):
    effect = get_effect("coupled_friction")
    shape = {"ratio": 0.5, "differential": 1.0, "unequal": 1.0}
    apart = effect.torque_columns(signals, (0, 1), **shape)
    for joint in (0, 1):
        shafts = [effect.torque_columns(signals, (0, 1), ratio=r)[joint] for r in (0.5, -0.5)]
        np.testing.assert_allclose(apart[joint], np.hstack(shafts))
    names = [c.name for c in effect.coefficients_of(shape)]
    assert names == ["Fc", "Fv", "Fc2", "Fv2"]


def test_an_inertia_may_act_across_two_joints_only(signals):
    columns = get_effect("coupled_inertia").torque_columns(signals, (0, 1), ratio=-1.0, across=1.0)
    np.testing.assert_array_equal(columns[0][:, 0], -signals.ddq[:, 1])
    np.testing.assert_array_equal(columns[1][:, 0], -signals.ddq[:, 0])


def test_coupled_friction_is_tried_with_ratios_of_common_gears(signals):
    """Whether the two joints turn the shaft forwards or back depends on the ratio."""
    grid = get_effect("coupled_friction").grid(signals, (0, 1))
    plain = {shape["ratio"] for shape in grid if len(shape) == 1}
    assert plain == {1.0, -1.0, 0.5, -0.5, 2.0, -2.0}
    assert all(shape["ratio"] > 0 for shape in grid if "differential" in shape)


@pytest.mark.parametrize("kind", ["coupled_friction", "coupled_inertia", "coupling_spring"])
def test_a_ratio_with_which_one_joint_feels_nothing_is_no_coupling(signals, kind):
    allowed = [
        ratio
        for ratio in (0.01, 0.05, 0.2, 1.0, 5.0, 20.0)
        if get_effect(kind).admissible(signals, (0, 1), {"ratio": -ratio})
    ]
    assert allowed == [0.2, 1.0, 5.0]


def test_a_cable_between_two_joints_only_pulls(signals):
    effect, x = get_effect("coupling_spring"), signals.q[:, 0] + 0.5 * signals.q[:, 1] - 0.1
    for side in (1.0, -1.0):
        columns = effect.torque_columns(signals, (0, 1), ratio=0.5, x0=0.1, side=side)
        np.testing.assert_allclose(columns[0][:, 0], np.where(side * x > 0, x, 0.0))
        np.testing.assert_allclose(columns[1], 0.5 * columns[0])


def test_a_coupling_with_slack_pulls_beyond_it_on_both_sides(signals):
    effect, x = get_effect("coupling_spring"), signals.q[:, 0] + 0.5 * signals.q[:, 1]
    rest, reach = float(x.min() + x.max()) / 2, float(np.ptp(x)) / 2
    shape = {"ratio": 0.5, "x0": rest, "slack": 0.4 * reach}
    columns = effect.torque_columns(signals, (0, 1), **shape)
    beyond = np.abs(x - rest) - 0.4 * reach
    expected = np.sign(x - rest) * np.maximum(beyond, 0.0)
    np.testing.assert_allclose(columns[0][:, 0], expected, atol=1e-12)
    np.testing.assert_allclose(columns[1], 0.5 * columns[0])
    assert effect.admissible(signals, (0, 1), shape)
    assert not effect.admissible(signals, (0, 1), shape | {"slack": 1.1 * reach})


def test_a_spring_does_not_stiffen_within_a_tiny_share_of_its_travel(signals):
    effect, x = get_effect("coupling_spring"), signals.q[:, 0] - 10 * signals.q[:, 1]
    shape = {"ratio": -10.0, "x0": float(np.median(x))}
    reach = float(np.abs(x - shape["x0"]).max())
    assert effect.admissible(signals, (0, 1), shape | {"stiffening": reach / 3})
    assert not effect.admissible(signals, (0, 1), shape | {"stiffening": reach / 400})


def test_a_coupling_with_another_stiffness_beyond_its_bend(signals):
    effect = get_effect("coupling_spring")
    x = signals.q[:, 0] + 0.5 * signals.q[:, 1] - 0.1
    columns = effect.torque_columns(signals, (0, 1), ratio=0.5, x0=0.1, bent=1.0)
    expected = np.column_stack([x, np.maximum(x, 0), np.ones_like(x)])
    np.testing.assert_allclose(columns[0], expected)
    np.testing.assert_allclose(columns[1], 0.5 * expected)
    assert [c.name for c in effect.coefficients_of({"bent": 1.0})] == ["k", "dk", "tau0"]
    assert [c.name for c in effect.coefficients_of({})] == ["k", "tau0"]


@pytest.mark.parametrize("of", [1.0, 2.0])
def test_the_power_of_an_inertia_behind_a_lever_is_the_change_of_its_energy(signals, of):
    effect = get_effect("coupled_inertia")
    shape = {"ratio": -0.6, "lever": 0.8, "of": of, "middle": 0.2}
    q, dq = signals.q, signals.dq
    levered = 1 + 0.8 * (q[:, int(of) - 1] - 0.2)
    turns = (
        dq
        * [1.0, -0.6]
        * np.column_stack([levered if of == k else 1 + 0 * levered for k in (1, 2)])
    )
    energy = 0.5 * turns.sum(1) ** 2

    columns = effect.torque_columns(signals, (0, 1), **shape)

    power = sum(columns[j][:, 0] * dq[:, j] for j in range(2))
    for rows in signals.segments:
        change = np.gradient(energy[rows], signals.clock[rows])
        np.testing.assert_allclose(power[rows][2:-2], change[2:-2], atol=0.02 * np.ptp(change))


@pytest.mark.parametrize("form", [{}, {"x0": 0.0, "bent": 1.0}, {"x0": 0.0, "softening": 0.4}])
def test_a_spring_between_joints_does_not_push_them_away_from_where_it_is_slack(form):
    stiffness = get_effect("coupling_spring").coefficients_of({"ratio": -1.0, **form})[0]
    assert (stiffness.name, stiffness.sign) == ("k", 1)
