# SPDX-License-Identifier: BSD-3-Clause
"""Simulated logs hold the physics that they say they hold."""

import numpy as np
import pytest

from skidyn.datasets import (
    hidden_effect_kinds,
    load_panda,
    load_planar_arm,
    load_scara,
    make_hidden_effect_log,
)
from skidyn.exceptions import SkidynError

PLANAR, SCARA = load_planar_arm(), load_scara()
SHORT = {"n_trajectories": 4, "duration": 4.0}


def difference(robot, effect, **options):
    """Torque of an effect: a noiseless log with it less one without."""
    with_effect = make_hidden_effect_log(robot, effect, noise=0.0, **SHORT, **options)
    base = with_effect.base
    without = make_hidden_effect_log(robot, None, noise=0.0, base=base, **SHORT)
    return with_effect, with_effect.y - without.y


def test_table_follows_the_contract():
    log = make_hidden_effect_log(SCARA, "temperature_offset", **SHORT)
    names = [f"{name}{k}" for name in ("q", "dq", "tau", "temp") for k in range(1, 5)]
    assert log.frame.columns.tolist() == ["time", "trajectory", *names]
    state = [f"{name}{k}" for name in ("q", "dq", "ddq", "temp") for k in range(1, 5)]
    assert log.X.columns.tolist() == ["time", "trajectory", *state]
    assert log.y.shape == (1600, 4) and log.noise_std.shape == (4,)
    assert np.isfinite(log.X.to_numpy()).all() and np.isfinite(log.y).all()
    assert (log.frame.groupby("trajectory")["time"].diff().dropna() > 0).all()
    assert log.frame["time"].is_monotonic_increasing


@pytest.mark.parametrize("kind", hidden_effect_kinds())
@pytest.mark.parametrize("robot", [PLANAR, SCARA], ids=["planar", "scara"])
def test_every_effect_is_visible_and_told(robot, kind):
    log, torque = difference(robot, kind)
    (truth,) = log.truth
    assert truth["kind"] == ("unknown" if kind.startswith("unknown") else kind)
    assert truth["parameters"] and truth["formula"]
    if kind.startswith("unknown"):
        assert truth["variables"]
    if kind == "time_delay":  # changes the positions that belong to a torque
        return
    felt = np.sqrt(np.mean(torque**2, axis=0)) / log.y.std(axis=0)
    assert felt.max() > 0.01
    if log.joints and kind not in ("backlash", "payload"):  # those are felt by other joints too
        others = [k for k in range(robot.n_joints) if k + 1 not in log.joints]
        assert np.all(felt[others] < 1e-9)


def test_same_seed_same_log_and_other_seed_other_log():
    first, second = (make_hidden_effect_log(PLANAR, "dahl", **SHORT) for _ in range(2))
    assert first.frame.equals(second.frame)
    other = make_hidden_effect_log(PLANAR, "dahl", random_state=1, **SHORT)
    assert not np.allclose(first.y, other.y)
    generator = np.random.default_rng(0)
    assert make_hidden_effect_log(PLANAR, None, random_state=generator, **SHORT).y.shape == (
        1600,
        2,
    )


def test_robot_differs_from_the_nominal_one_and_stays_physical():
    robot = load_panda()
    log = make_hidden_effect_log(robot, None, base=(), noise=0.0, **SHORT)
    ratio = log.true_parameters[:, 0] / robot.inertial_parameters[:, 0]
    assert np.all((np.abs(ratio - 1) > 0.09) & (np.abs(ratio - 1) < 0.21))
    for m, hx, hy, hz, xx, xy, xz, yy, yz, zz in log.true_parameters:
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        h = np.array([[hx, hy, hz]])
        pseudo = np.block([[np.trace(inertia) / 2 * np.eye(3) - inertia, h.T], [h, m]])
        assert np.linalg.eigvalsh(pseudo)[0] > 0
    state = (log.X[[f"{s}{k}" for k in range(1, 8)]].to_numpy() for s in ("q", "dq"))
    q, dq = state
    moving = robot.inverse_dynamics(q, dq, np.zeros_like(q), parameters=log.true_parameters)
    slow = np.abs(log.X[[f"ddq{k}" for k in range(1, 8)]].to_numpy()).max(axis=1) < 0.02
    np.testing.assert_allclose(log.y[slow], moving[slow], atol=0.15)


def test_motion_keeps_the_limits():
    robot = load_panda()
    log = make_hidden_effect_log(robot, None, **SHORT)
    q = log.frame[[f"q{k}" for k in range(1, 8)]].to_numpy()
    low, high = robot.position_limits.T
    assert np.all(q > low - 1e-3) and np.all(q < high + 1e-3)
    dq = log.frame[[f"dq{k}" for k in range(1, 8)]].to_numpy()
    assert np.all(np.abs(dq).max(axis=0) < robot.velocity_limits)


def test_velocity_belongs_to_position():
    frame = make_hidden_effect_log(PLANAR, None, noise=0.0, **SHORT).frame
    one = frame[frame["trajectory"] == 1]
    derived = np.gradient(one["q1"], one["time"])
    np.testing.assert_allclose(derived[5:-5], one["dq1"][5:-5], atol=0.02)


def test_viscous_and_spring_have_their_formula():
    log, torque = difference(PLANAR, "viscous", joints=[2])
    np.testing.assert_allclose(torque[:, 1], log.parameters["Fv"][0] * log.frame["dq2"], atol=1e-9)
    log, torque = difference(PLANAR, "spring", joints=[1])
    k, q0 = log.parameters["k"][0], log.parameters["q0"][0]
    np.testing.assert_allclose(torque[:, 0], k * (log.frame["q1"] - q0), atol=1e-3 * k)


def test_magnitude_multiplies():
    small, large = (difference(PLANAR, "coulomb", joints=[1], magnitude=m)[1] for m in (0.5, 2.0))
    np.testing.assert_allclose(large, 4 * small, atol=1e-9)


def test_dahl_turns_over_its_presliding_distance():
    log = make_hidden_effect_log(
        PLANAR, "dahl", joints=[1], noise=0.0, base=(), n_trajectories=2, rate=1000.0
    )
    bare = make_hidden_effect_log(PLANAR, None, noise=0.0, base=(), n_trajectories=2, rate=1000.0)
    force = (log.y - bare.y)[:10_000, 0] / log.parameters["Fc"][0]
    q = log.frame["q1"].to_numpy()[:10_000]
    dq = log.frame["dq1"].to_numpy()[:10_000]
    assert np.abs(force).max() < 1 + 1e-9
    turn = int(np.flatnonzero(np.diff(np.sign(dq)))[0]) + 1
    travelled = np.abs(q[turn:] - q[turn])
    after = turn + int(np.argmax(travelled > log.parameters["presliding"][0]))
    # after one pre-sliding distance a Dahl element has covered 1 - 1/e of the way round
    before, now = force[turn], force[after] * np.sign(dq[after])
    expected = 1 - (1 + np.abs(before)) * np.exp(-1)
    np.testing.assert_allclose(now, expected, atol=0.05)


def test_hysteresis_replaces_the_coulomb_friction_of_its_joint():
    log = make_hidden_effect_log(PLANAR, "lugre", joints=[2], noise=0.0, base=("coulomb",), **SHORT)
    bare = make_hidden_effect_log(PLANAR, "lugre", joints=[2], noise=0.0, base=(), **SHORT)
    np.testing.assert_allclose(log.y[:, 1], bare.y[:, 1], atol=1e-9)
    assert not np.allclose(log.y[:, 0], bare.y[:, 0])


def test_elastic_joint_reports_the_motor_position():
    log = make_hidden_effect_log(
        PLANAR, "joint_elasticity", joints=[1], noise=0.0, base=(), **SHORT
    )
    rigid = make_hidden_effect_log(PLANAR, None, noise=0.0, base=(), **SHORT)
    np.testing.assert_allclose(log.y, rigid.y, atol=1e-9)
    twist = (log.frame["q1"] - rigid.frame["q1"]).to_numpy()
    np.testing.assert_allclose(twist, log.y[:, 0] / log.parameters["K"][0], atol=1e-4)


def test_backlash_lets_the_link_fly_between_the_flanks():
    log, torque = difference(PLANAR, "backlash", joints=[1], base=())
    flying = np.abs(log.y[:, 0]) < 1e-3 * np.abs(log.y[:, 0]).max()
    assert 0.002 < flying.mean() < 0.5
    assert np.abs(torque[:, 0].mean()) < 0.2 * torque[:, 0].std()


def test_payload_and_wrench_act_in_their_trajectories_only():
    for kind in ("payload", "external_wrench"):
        log, torque = difference(PLANAR, kind)
        loaded = np.isin(log.frame["trajectory"], log.parameters["trajectories"])
        assert np.abs(torque[loaded]).max() > 0 and np.abs(torque[~loaded]).max() == 0
    with pytest.raises(SkidynError, match="some trajectories only"):
        make_hidden_effect_log(PLANAR, "payload", n_trajectories=1, duration=2.0)


def test_delayed_torque_belongs_to_an_earlier_position():
    log = make_hidden_effect_log(PLANAR, "time_delay", noise=0.0, **SHORT)
    prompt = make_hidden_effect_log(PLANAR, None, noise=0.0, **SHORT)
    samples = round(log.parameters["delay"] * 100)
    one, two = (x.frame.query("trajectory == 1")["q1"].to_numpy() for x in (log, prompt))
    np.testing.assert_allclose(one[:-samples], two[samples:], atol=1e-4)


def test_saturated_torque_stays_within_the_limit():
    log = make_hidden_effect_log(PLANAR, "saturation", joints=[1], **SHORT)
    assert np.abs(log.y[:, 0]).max() == pytest.approx(log.parameters["limit"][0])


def test_noise_has_the_stated_size_and_colour():
    noisy = make_hidden_effect_log(PLANAR, None, noise="high", **SHORT)
    clean = make_hidden_effect_log(PLANAR, None, noise=0.0, **SHORT)
    noise = (noisy.y - clean.y).reshape(4, 400, 2)
    np.testing.assert_allclose(noise.std(axis=(0, 1)), noisy.noise_std, rtol=0.15)
    lag_one = np.mean(noise[:, 1:] * noise[:, :-1], axis=(0, 1)) / noise.var(axis=(0, 1))
    assert np.all((lag_one > 0.15) & (lag_one < 0.5))


def test_several_effects_add_up():
    both = make_hidden_effect_log(PLANAR, ["spring", "coulomb"], base=(), noise=0.0, **SHORT)
    assert [effect["kind"] for effect in both.truth] == ["spring", "coulomb"]
    assert both.effect == "spring"
    options = {"spring": {"joints": [1]}, "coulomb": {"joints": [2], "magnitude": 2.0}}
    chosen = make_hidden_effect_log(PLANAR, options, **SHORT)
    assert [effect["joints"] for effect in chosen.truth] == [(1,), (2,)]


def test_nothing_hidden():
    log = make_hidden_effect_log(PLANAR, None, **SHORT)
    assert (log.effect, log.joints, log.parameters, log.truth) == (None, (), {}, ())


@pytest.mark.parametrize(
    "options, message",
    [
        ({"effect": "dhal"}, "Did you mean 'dahl'"),
        ({"effect": "dahl", "joints": [3]}, "counted from 1 to 2"),
        ({"effect": "unknown_cable", "joints": [1]}, "couples two joints"),
        ({"effect": {"dahl": {"size": 2}}}, "unknown option.* size"),
        ({"effect": None, "base": ["glue"]}, "'glue' cannot be simulated"),
        ({"effect": None, "duration": 0.01}, "at least one trajectory and ten samples"),
        ({"effect": "time_delay", "magnitude": 50.0}, "too long"),
    ],
)
def test_requests_that_cannot_be_met(options, message):
    with pytest.raises(SkidynError, match=message):
        make_hidden_effect_log(PLANAR, **SHORT | options)
