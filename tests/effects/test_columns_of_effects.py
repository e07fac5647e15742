# SPDX-License-Identifier: BSD-3-Clause
"""Columns of the catalogue against formulas written step by step."""

import numpy as np
import pytest

from skidyn._signals import Signals
from skidyn.datasets import load_planar_arm, load_scara
from skidyn.effects import (
    Coefficient,
    Effect,
    Term,
    dahl_state,
    get_effect,
    list_effects,
    make_terms,
    register_effect,
    stop_state,
    unregister_effect,
)
from skidyn.exceptions import EffectError

ROBOT = load_planar_arm()


@pytest.fixture
def signals():
    t = np.arange(0, 6, 0.01)
    phase = np.column_stack([1.3 * t, 2.1 * t])
    rates = np.array([1.3, 2.1])
    return Signals(
        0.5 * np.sin(phase),
        0.5 * rates * np.cos(phase),
        -0.5 * rates**2 * np.sin(phase),
        trajectory=np.repeat([0, 1], 300),
        time=t,
        temperature=np.column_stack([30 + t, 40 - t]),
        robot=ROBOT,
        load=np.column_stack([np.cos(t), np.sin(t)]),
        model_torque=np.column_stack([np.sin(3 * t), np.cos(3 * t)]),
    )


def columns(kind, signals, joint=0, **shape):
    return get_effect(kind).columns(signals, joint, **shape)


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


def test_stop_operator_step_by_step(signals):
    q, way = signals.q[:, 1], 0.04
    expected = np.zeros(len(q))
    for rows in signals.segments:
        for i in range(rows.start + 1, rows.stop):
            expected[i] = np.clip(expected[i - 1] + (q[i] - q[i - 1]) / way, -1, 1)
    np.testing.assert_allclose(stop_state(q, signals.segments, way), expected, atol=1e-12)
    block = columns("maxwell_slip", signals, 1, presliding=way)
    np.testing.assert_allclose(block[:, 0], expected, atol=1e-12)
    np.testing.assert_array_equal(block[:, 1], stop_state(q, signals.segments, way / 2))


def test_a_rest_does_not_break_a_stroke():
    q = np.array([0.0, 0.0, 0.1, 0.1, 0.3, 0.3, 0.2])
    np.testing.assert_allclose(
        stop_state(q, [slice(0, 7)], 0.4), [0, 0, 0.25, 0.25, 0.75, 0.75, 0.5]
    )


def test_friction(signals):
    v, sign = signals.dq[:, 0], np.sign(signals.dq[:, 0])
    fast = np.abs(v) > 0.02
    stribeck = columns("stribeck", signals, vs=0.1, delta=2.0)[:, 0]
    np.testing.assert_allclose(stribeck[fast], (sign * np.exp(-((v / 0.1) ** 2)))[fast], atol=1e-4)
    np.testing.assert_allclose(columns("coulomb", signals)[fast, 0], sign[fast], atol=1e-4)
    power = columns("nonlinear_viscous", signals, power=2.0)[:, 0]
    np.testing.assert_allclose(power, v * np.abs(v), atol=1e-4)
    np.testing.assert_array_equal(columns("asymmetric_friction", signals)[:, 0], np.abs(v))
    load = columns("load_dependent_friction", signals)[:, 0]
    np.testing.assert_allclose(load[fast], (np.abs(signals.load[:, 0]) * sign)[fast], atol=1e-4)
    lugre = columns("lugre", signals, presliding=0.02, vs=0.1)
    state = dahl_state(signals.q[:, 0], signals.segments, 0.02)
    expected = np.column_stack([state, state * np.exp(-((v / 0.1) ** 2))])
    np.testing.assert_allclose(lugre, expected)


def test_periodic_effects_name_amplitude_and_phase(signals):
    q = signals.q[:, 0]
    ripple, friction = get_effect("torque_ripple"), get_effect("position_dependent_friction")
    a = np.array([0.3, -0.4])
    found = ripple.parameters(a, {"N": 20.0})
    np.testing.assert_allclose(
        ripple.columns(signals, 0, N=20.0) @ a, found["A"] * np.sin(20 * q - found["phase"])
    )
    found = friction.parameters(a, {"n": 2.0})
    expected = found["A"] * np.cos(2 * q - found["phase"]) * signals.sign[:, 0]
    np.testing.assert_allclose(friction.columns(signals, 0, n=2.0) @ a, expected)


def test_springs(signals):
    q = signals.q[:, 0]
    spring = get_effect("spring")
    found = spring.parameters(np.array([4.0, -2.0]), {})
    np.testing.assert_allclose(
        spring.columns(signals, 0) @ [4.0, -2.0], found["k"] * (q - found["q0"])
    )
    high = columns("end_stop", signals, q_lim=0.4, side=1.0)[:, 0]
    np.testing.assert_allclose(high, np.where(q > 0.4, q - 0.4, 0))
    low = columns("end_stop", signals, q_lim=-0.4, side=-1.0)[:, 0]
    np.testing.assert_allclose(low, np.where(q < -0.4, q + 0.4, 0))
    cubic = columns("nonlinear_spring", signals, q_middle=0.1) @ [1.0, 2.0, 3.0, 4.0]
    x = q - 0.1
    np.testing.assert_allclose(cubic, x + 2 * x**2 + 3 * x**3 + 4)
    one = Term("offset", (1,), {"trajectories": (1,)}).torque_columns(signals)[0][:, 0]
    np.testing.assert_array_equal(one, signals.trajectory == 1)


def test_temperature(signals):
    warm, v = signals.temperature[:, 1] - 30.0, signals.dq[:, 1]
    block = columns("temperature_friction", signals, 1)
    expected = np.column_stack([warm * v, warm * signals.sign[:, 1], warm**2 * v])
    np.testing.assert_allclose(block, expected)
    np.testing.assert_allclose(columns("temperature_offset", signals, 1)[:, 0], warm)
    cold = signals.with_(temperature=None)
    assert "no temperature" in get_effect("temperature_friction").not_shown(cold, 0)


def test_couplings_act_on_both_joints(signals):
    for kind, state in (("coupled_inertia", signals.ddq), ("coupling_spring", signals.q)):
        blocks = get_effect(kind).torque_columns(signals, (0, 1), ratio=-2.0)
        x = state[:, 0] - 2 * state[:, 1]
        np.testing.assert_allclose(blocks[0][:, 0], x)
        np.testing.assert_allclose(blocks[1], -2 * blocks[0])


def test_delay_is_a_shift(signals):
    torque, delay = signals.model_torque, 0.004
    change = get_effect("time_delay").torque_columns(signals, (0, 1))
    shifted = np.sin(3 * (signals.time - delay))
    inner = np.r_[2:298, 302:598]
    np.testing.assert_allclose(
        (torque[:, 0] + delay * change[0][:, 0])[inner], shifted[inner], atol=2e-4
    )


def test_saturation_and_gain(signals):
    torque = signals.model_torque[:, 0]
    cut = torque + columns("saturation", signals, limit=0.6)[:, 0]
    np.testing.assert_allclose(cut, np.clip(torque, -0.6, 0.6))
    np.testing.assert_array_equal(columns("torque_gain", signals)[:, 0], torque)


def test_payload_is_a_heavier_last_link(signals):
    body = np.array([0.7, 0.1, 0.02, -0.05, 0.02, 0.001, 0.0, 0.03, 0.0, 0.04])
    heavier = ROBOT.inertial_parameters.copy()
    heavier[-1] += body
    state = signals.q, signals.dq, signals.ddq
    change = ROBOT.inverse_dynamics(*state, parameters=heavier) - ROBOT.inverse_dynamics(*state)
    blocks = Term("payload", (1, 2), {"trajectories": (1,)}).torque_columns(signals)
    for j in range(2):
        np.testing.assert_allclose(blocks[j][300:] @ body, change[300:, j], atol=1e-10)
        assert not blocks[j][:300].any()


def test_wrench_works_against_the_motion_of_the_tool(signals):
    force, step = np.array([1.0, -2.0, 0.5]), 1e-6
    blocks = get_effect("external_wrench").torque_columns(signals, (0, 1))
    for j in range(2):
        moved = signals.q + step * np.eye(2)[j]
        before, after = (ROBOT.forward_kinematics(q)[0] for q in (signals.q, moved))
        work = (after - before) @ force / step
        np.testing.assert_allclose(blocks[j] @ force, -work, atol=1e-5)


def test_contact_only_below_its_plane(signals):
    tool = ROBOT.forward_kinematics(signals.q)[0][:, 2]
    plane = float(np.median(tool))
    contact = get_effect("environment_contact")
    blocks = contact.torque_columns(signals, (0, 1), z0=plane, side=1.0, axis=2)
    assert not blocks[0][tool > plane].any()
    expected = -np.maximum(0, plane - tool) * ROBOT.jacobian(signals.q)[:, 2, 0]
    np.testing.assert_allclose(blocks[0][:, 0], expected)


def test_tilt_is_a_change_of_gravity(signals):
    tilted = np.asarray(ROBOT.gravity) + [0.3, -0.2, 0.0]
    rest = np.zeros_like(signals.q)
    change = ROBOT.inverse_dynamics(signals.q, rest, rest, gravity=tilted)
    change = change - ROBOT.inverse_dynamics(signals.q, rest, rest)
    blocks = get_effect("base_tilt").torque_columns(signals, (0, 1))
    for j in range(2):
        np.testing.assert_allclose(blocks[j][:, :2] @ [0.3, -0.2], change[:, j], atol=1e-10)


def test_catalogue_is_complete():
    assert len(list_effects()) == len(set(list_effects())) == 32
    for kind in list_effects():
        effect = get_effect(kind)
        effect.check()
        assert effect.describe()["kind"] == kind and effect.reference
        assert set(effect.rivals) <= {*list_effects(), "unknown"}, kind
    with pytest.raises(EffectError, match="no effect 'dahll'"):
        get_effect("dahll")


def test_units_of_sliders():
    assert get_effect("viscous").units(prismatic=True) == {"Fv": "N s/m"}
    assert get_effect("rotor_inertia").units(prismatic=True) == {"Ia": "kg"}
    slides = np.array([kind == "prismatic" for kind in load_scara().joint_types])
    zero = np.zeros((3, 4))
    scara = Signals(zero, zero, zero, trajectory=np.zeros(3), prismatic=slides)
    dahl = get_effect("dahl")
    assert dahl.grid(scara, (2,))[0]["presliding"] == pytest.approx(
        dahl.grid(scara, (0,))[0]["presliding"] / 10
    )


def test_a_slider_and_a_rotary_joint_can_be_coupled():
    slides = np.array([kind == "prismatic" for kind in load_scara().joint_types])
    zero = np.zeros((3, 4))
    scara = Signals(zero, zero, zero, trajectory=np.zeros(3), prismatic=slides)
    spring = get_effect("coupling_spring")
    assert (2, 3) in spring.sites(scara)
    for pair, expected in (((2, 3), (0.01, 0.1, 1.0)), ((0, 1), (1.0,))):
        ratios = sorted({abs(shape["ratio"]) for shape in spring.grid(scara, pair)})
        assert ratios == pytest.approx(expected)


@pytest.mark.parametrize("kind", list_effects())
def test_every_parameter_has_a_unit(kind):
    effect = get_effect(kind)
    shape = {shape.name: 1.0 for shape in effect.shapes}
    found = effect.parameters(np.ones(len(effect.coefficients)), shape)
    assert set(found) <= set(effect.units())


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("dahll", "no effect"),
        (("dahl", [3]), "no joint 3"),
        (("dahl", [0]), "no joint 0"),
        (("coupled_friction", [1]), "couples two joints"),
    ],
)
def test_terms_that_cannot_be(spec, words):
    with pytest.raises(EffectError, match=words):
        make_terms([spec], 2)


def test_diagnosis_finds_a_users_effect():
    from skidyn.datasets import make_hidden_effect_log
    from skidyn.diagnosis import diagnose
    from skidyn.identification import RBDRegressor

    class Magnet(Effect):
        kind = "magnet"
        title = "Magnet"
        formula = r"a\,e^{-(q/0.2)^2}"
        coefficients = (Coefficient("a", "N m"),)
        drawn_against = "q"

        def columns(self, signals, joint, **shape):
            return np.exp(-((signals.q[:, joint] / 0.2) ** 2))[:, None]

    log = make_hidden_effect_log(ROBOT, None, n_trajectories=6, duration=6.0)
    y = np.array(log.y, dtype=float)
    y[:, 1] += 2.0 * np.exp(-((np.asarray(log.X["q2"]) / 0.2) ** 2))
    register_effect(Magnet)
    try:
        effects = ["magnet", "spring", "dahl"]
        found = diagnose(RBDRegressor(log.robot), log.X, y, effects=effects).findings
        assert [f.kind for f in found] == ["magnet"]
        assert found[0].terms[0].joints == (2,)
    finally:
        unregister_effect("magnet")
