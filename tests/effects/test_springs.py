# SPDX-License-Identifier: BSD-3-Clause
"""Columns of springs and stops against their formulas."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_scara, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.effects import Signals, Term, get_effect
from skidyn.identification import RBDRegressor


def test_springs(signals, columns_of):
    q = signals.q[:, 0]
    spring = get_effect("spring")
    found = spring.parameters(np.array([4.0, -2.0]), {})
    np.testing.assert_allclose(
        spring.columns(signals, 0) @ [4.0, -2.0], found["k"] * (q - found["q0"])
    )
    high = columns_of("end_stop", signals, q_lim=0.4, side=1.0)[:, 0]
    np.testing.assert_allclose(high, np.where(q > 0.4, q - 0.4, 0))
    low = columns_of("end_stop", signals, q_lim=-0.4, side=-1.0)[:, 0]
    np.testing.assert_allclose(low, np.where(q < -0.4, q + 0.4, 0))
    cubic = columns_of("nonlinear_spring", signals, q_middle=0.1) @ [1.0, 2.0, 3.0, 4.0]
    x = q - 0.1
    np.testing.assert_allclose(cubic, x + 2 * x**2 + 3 * x**3 + 4)
    one = Term("offset", (1,), {"trajectories": (1,)}).torque_columns(signals)[0][:, 0]
    np.testing.assert_array_equal(one, signals.trajectory == 1)


def test_a_bumper_that_stiffens(signals, columns_of):
    q = signals.q[:, 0]
    low = columns_of("end_stop", signals, q_lim=-0.4, side=-1.0, power=2.0)[:, 0]
    np.testing.assert_allclose(low, -(np.minimum(0, q + 0.4) ** 2))


def test_a_stop_of_foam_stiffens_exponentially(signals, columns_of):
    q = signals.q[:, 0]
    foam = columns_of("end_stop", signals, q_lim=0.4, side=1.0, stiffening=0.2)[:, 0]
    np.testing.assert_allclose(foam, 0.2 * np.expm1(np.maximum(0, q - 0.4) / 0.2))


def test_a_stop_is_not_tried_with_a_stiffness_that_would_overflow():
    turns = np.linspace(-200.0, 200.0, 50)[:, None]
    signals = Signals(turns, 0 * turns, 0 * turns, trajectory=np.zeros(50))
    effect = get_effect("end_stop")
    stop = {"q_lim": 120.0, "side": 1.0}
    assert effect.admissible(signals, (0,), stop | {"stiffening": 30.0})
    assert not effect.admissible(signals, (0,), stop | {"stiffening": 0.01})


def test_a_bumper_that_loses_energy_resists_the_way_in_and_never_pulls(signals, columns_of):
    q, dq = signals.q[:, 0], signals.dq[:, 0]
    lossy = columns_of("end_stop", signals, q_lim=0.3, side=1.0, damping=3.0)[:, 0]
    depth = np.maximum(0.0, q - 0.3)
    np.testing.assert_allclose(lossy, depth * np.maximum(0.0, 1 + 3.0 * dq))
    assert np.any((depth > 0) & (lossy == 0))


def test_stops_at_both_ends_push_back_to_the_middle(signals, columns_of):
    q = signals.q[:, 0]
    both = columns_of("end_stop", signals, q_lim=0.3, q_low=-0.4, side=1.0)[:, 0]
    np.testing.assert_allclose(both, np.maximum(0, q - 0.3) + np.minimum(0, q + 0.4))


def test_a_spring_of_pieces_is_continuous(signals, columns_of):
    pieces = columns_of("nonlinear_spring", signals, low=-0.2, high=0.3) @ [2.0, 5.0, 1.0, 0.5]
    inside = [2 * 0.3 + 0.5, 2 * -0.2 + 0.5]
    corners = [np.min(np.abs(pieces - value)) for value in inside]
    assert max(corners) < 0.01
    q = signals.q[:, 0]
    np.testing.assert_allclose(pieces[q > 0.3], 1.1 + q[q > 0.3] - 0.3)
    np.testing.assert_allclose(pieces[q < -0.2], 0.1 + 5 * (q[q < -0.2] + 0.2))


def test_a_spring_of_another_power_than_the_third(signals, columns_of):
    q = signals.q[:, 0]
    fifth = columns_of("nonlinear_spring", signals, rest=0.1, power=5.0) @ [0.0, 0.0, 2.0, 0.0]
    np.testing.assert_allclose(fifth, 2 * (q - 0.1) ** 5)


def test_a_step_of_the_torque_is_no_piece_of_a_spring():
    spring = get_effect("nonlinear_spring")
    q = np.linspace(-1, 1, 500)[:, None]
    travel = Signals(q, 0 * q, 0 * q, np.zeros(500, dtype=int))
    assert spring.admissible(travel, (0,), {"low": -0.2, "high": 0.3})
    assert not spring.admissible(travel, (0,), {"low": 0.0, "high": 0.05})


def test_a_spring_that_stiffens_exponentially(signals, columns_of):
    x = signals.q[:, 0] - 0.1
    rubber = columns_of("nonlinear_spring", signals, rest=0.1, scale=0.2) @ [0.0, 0.0, 3.0, 0.0]
    np.testing.assert_allclose(rubber, 3 * 0.2**3 * np.sinh(x / 0.2))


def test_dampers_at_both_ends(signals, columns_of):
    ends = {"side": 1.0, "q_lim": 0.3, "q_low": -0.3}
    plain = columns_of("end_stop", signals, **ends)[:, 0]
    damped = columns_of("end_stop", signals, damping=0.5, **ends)[:, 0]
    side = np.sign(plain)
    factor = np.maximum(0.0, 1.0 + 0.5 * side * signals.dq[:, 0])
    np.testing.assert_allclose(damped, plain * factor)


def test_rubber_is_not_tried_where_its_torque_would_overflow():
    turns = np.linspace(-200.0, 200.0, 50)[:, None]
    signals = Signals(turns, 0 * turns, 0 * turns, trajectory=np.zeros(50))
    effect = get_effect("nonlinear_spring")
    for shape in effect.grid(signals, (0,)):
        assert np.abs(effect.torque_columns(signals, (0,), **shape)[0]).max() < 1e20
    assert effect.admissible(signals, (0,), {"rest": 0.0, "scale": 20.0})
    assert not effect.admissible(signals, (0,), {"rest": 0.0, "scale": 0.3})


def test_a_second_spring_sets_in_behind_a_soft_bumper(signals, columns_of):
    q = signals.q[:, 0]
    both = columns_of("end_stop", signals, q_lim=0.2, side=1.0, q_further=0.5)
    np.testing.assert_allclose(both[:, 0], np.maximum(0, q - 0.2))
    np.testing.assert_allclose(both[:, 1], np.maximum(0, q - 0.5))
    effect = get_effect("end_stop")
    assert len(effect.coefficients_of({"q_further": 0.5})) == 2
    assert len(effect.coefficients_of({})) == 1
    joints, stop = (0,), {"q_lim": 0.0, "side": 1.0}
    assert not effect.admissible(signals, joints, stop | {"q_further": -0.1})


def test_a_coil_spring_between_two_points_of_the_links(signals, columns_of):
    q, near, far, free, stiffness, zero = signals.q[:, 0], 0.12, 0.4, 0.25, 300.0, -1.1
    length = np.sqrt(near**2 + far**2 - 2 * near * far * np.cos(q - zero))
    torque = stiffness * (length - free) * near * far * np.sin(q - zero) / length
    columns = columns_of("gravity_compensator", signals, aligned=zero, lever=near / far)
    size = stiffness * near * far
    np.testing.assert_allclose(columns @ [size, size * free / far, 0.0], torque, atol=1e-12)


def test_a_counterweight_and_its_second_harmonic(signals, columns_of):
    q = signals.q[:, 0]
    one = columns_of("gravity_compensator", signals)
    np.testing.assert_allclose(one @ [3.0, 4.0, 1.0], 3 * np.sin(q) + 4 * np.cos(q) + 1)
    two = columns_of("gravity_compensator", signals, overtone=1.0)
    effect = get_effect("gravity_compensator")
    assert [c.name for c in effect.coefficients_of({"overtone": 1.0})][2:4] == ["a2", "b2"]
    three, q = columns_of("gravity_compensator", signals, overtone=3.0), signals.q[:, 0]
    np.testing.assert_allclose(three[:, [2, 3]], np.column_stack([np.sin(3 * q), np.cos(3 * q)]))
    assert [c.name for c in effect.coefficients_of({"overtone": 3.0})][2:4] == ["a3", "b3"]
    np.testing.assert_allclose(two[:, 2:4], np.column_stack([np.sin(2 * q), np.cos(2 * q)]))


def test_a_shock_absorber_resists_the_approach_only(signals, columns_of):
    q, dq = signals.q[:, 0], signals.dq[:, 0]
    limit = float(np.quantile(q, 0.8))

    found = columns_of("end_stop", signals, q_lim=limit, side=1.0, one_way=1.0) @ [50.0, 30.0]

    depth = np.maximum(0.0, q - limit)
    np.testing.assert_allclose(found, depth * (50.0 + 30.0 * np.maximum(0.0, dq)))
    effect = get_effect("end_stop")
    assert [c.name for c in effect.coefficients_of({"one_way": 1.0})] == ["k", "d"]
    assert effect.units(prismatic=True)["d"] == "N s/m^2"


def test_what_stops_a_vertical_slide_on_its_way_down_is_usually_a_contact():
    robot, stop = load_scara(), get_effect("end_stop")
    slides = np.array([kind == "prismatic" for kind in robot.joint_types])
    q = np.random.default_rng(0).uniform(-0.3, 0.3, (20, robot.n_joints))
    signals = Signals(q, q, q, np.zeros(20, dtype=int), prismatic=slides, robot=robot)
    slide = int(np.argmax(slides))
    down = float(-np.sign(robot.jacobian(signals.q)[0, 2, slide]))

    def usually(joint, **shape):
        return stop.usually(np.ones(1), shape, signals, [joint])

    assert usually(slide, q_lim=0.0, side=down) == "environment_contact"
    assert usually(slide, q_lim=0.0, side=-down) is None
    assert usually(slide, q_lim=0.1, q_low=-0.1, side=down) is None
    assert usually(0, q_lim=0.0, side=down) is None


def test_a_stop_may_be_touched_a_third_of_the_time():
    log = make_hidden_effect_log(load_planar_arm(), None, duration=6.0, random_state=1)
    q = log.X["q2"].to_numpy()
    limit = np.quantile(q, 0.65)
    y = log.y + np.eye(2)[1] * 4.0 * np.maximum(0.0, q - limit)[:, None]
    (finding,) = diagnose(RBDRegressor(log.robot), log.X, y).findings
    assert (finding.kind, finding.joints) == ("end_stop", (2,))
    assert finding.parameters["q_lim"]["value"] == pytest.approx(limit, abs=0.01)
    assert finding.parameters["k"]["value"] == pytest.approx(4.0, rel=0.02)


def test_pieces_of_a_spring_have_names_and_units_of_their_own():
    effect = get_effect("nonlinear_spring")
    names = [c.name for c in effect.coefficients_of({"low": -0.2, "high": 0.3})]
    assert names == ["k_between", "k_below", "k_above", "tau0"]
    assert {effect.units(True)[name] for name in names[:3]} == {"N/m"}
    assert "k_" in effect.formula_of({"low": 0.0, "high": 1.0}) != effect.formula_of({})
