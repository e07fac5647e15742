# SPDX-License-Identifier: BSD-3-Clause
"""Simulated logs hold the physics that they say they hold."""

import numpy as np
import pytest

from skidyn.datasets import hidden_effect_kinds, load_planar_arm, load_scara, make_hidden_effect_log
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


def test_magnitude_multiplies():
    small, large = (difference(PLANAR, "coulomb", joints=[1], magnitude=m)[1] for m in (0.5, 2.0))
    np.testing.assert_allclose(large, 4 * small, atol=1e-9)


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
