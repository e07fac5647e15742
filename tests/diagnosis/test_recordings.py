# SPDX-License-Identifier: BSD-3-Clause
"""What single recordings have is found in them."""

from __future__ import annotations

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.diagnosis._recordings import own_effects
from skidyn.effects import Signals, make_terms
from skidyn.evidence import make_problem
from skidyn.identification import RBDRegressor


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(
        load_planar_arm(), None, noise="high", duration=5.0, random_state=8
    )


def found(log, torque):
    """Kinds and joints of what is named in a log without a fault."""
    diagnosis = diagnose(RBDRegressor(log.robot), log.X, torque, checks=())
    return {(f.kind, f.joints) for f in diagnosis.findings}


@pytest.mark.slow
def test_a_sensor_zeroed_anew_before_each_recording(log):
    shift = 0.6 * np.random.default_rng(1).normal(size=10)
    torque = np.array(log.y)
    torque[:, 1] += shift[log.X["trajectory"].to_numpy() - 1] * np.std(torque[:, 1])

    # one finding for every recording that differs
    assert found(log, torque) == {("offset", (2,))}


def test_a_gain_that_changed_for_some_recordings(log):
    torque = np.array(log.y)
    torque[np.isin(log.X["trajectory"], [3, 7]), 1] *= 1.3

    assert found(log, torque) == {("torque_gain", (2,))}


def test_a_gain_with_another_size_in_every_recording(log):
    """The rest is noise that is correlated in time, so that it is not white."""
    gain = 1 + 0.3 * np.random.default_rng(2).normal(size=10)
    rows = np.random.default_rng(5).normal(0.0, 0.004, len(log.y) + 63)
    torque = np.array(log.y)
    torque[:, 1] *= gain[log.X["trajectory"].to_numpy() - 1]
    torque[:, 1] += np.std(torque[:, 1]) * np.convolve(rows, np.ones(64) / 8, "valid")

    assert found(log, torque) == {("torque_gain", (2,))}


def test_friction_of_the_model_may_have_another_level(log):
    q, dq = (log.X[[f"{name}{j}" for j in (1, 2)]].to_numpy() for name in ("q", "dq"))
    run, time = log.X["trajectory"].to_numpy(), log.X["time"].to_numpy()
    signals = Signals(q, dq, np.zeros_like(q), run, time=time, robot=log.robot)
    terms = make_terms(["viscous", "coulomb"], 2)
    problem = make_problem(signals, log.y, robot=log.robot, rigid_body=True, terms=terms)

    kinds = [(c.kind, c.joints) for c in own_effects(problem, ["coulomb", "friction_drift"])]

    assert kinds == [(kind, (j,)) for kind in ("coulomb", "friction_drift") for j in (0, 1)]


def test_friction_of_several_levels_drifts(log):
    torque, run = np.array(log.y), log.X["trajectory"].to_numpy()
    level = np.select([run == 4, run == 5, run == 6], [0.3, 0.8, 0.5], 0.0)
    torque[:, 1] += level * np.std(torque[:, 1]) * np.sign(log.X["dq2"])

    assert found(log, torque) == {("friction_drift", (2,))}


def test_an_offset_that_comes_and_goes_in_every_recording_is_no_offset(log):
    torque, time = np.array(log.y), log.X["time"].to_numpy()
    first = log.X.groupby("trajectory")["time"].transform("min").to_numpy()
    begins = np.random.default_rng(3).uniform(0.3, 1.2, 11)[log.X["trajectory"]]
    inside = (time - first > begins) & (time - first < begins + 3.0)
    torque[:, 1] += 0.5 * np.std(torque[:, 1]) * inside

    assert {kind for kind, _ in found(log, torque)} == {"unknown"}


def test_a_step_within_a_recording_is_an_offset_of_the_rest_of_the_log(log):
    torque, time = np.array(log.y), log.X["time"].to_numpy()
    middle = time[log.X["trajectory"] == 6].mean()
    torque[time > middle, 1] += 0.5 * np.std(torque[:, 1])

    (offset,) = diagnose(RBDRegressor(log.robot), log.X, torque, checks=()).findings

    assert (offset.kind, offset.joints) == ("offset", (2,))
    assert offset.trajectories == tuple(range(6, 11))
    ((first, start, _),) = offset.terms[0].spans
    assert first == 6 and start == pytest.approx(middle, abs=0.2)


@pytest.mark.slow
def test_an_offset_from_a_recording_on_is_one_of_the_later_recordings():
    log = make_hidden_effect_log(
        load_ur5(), None, noise="low", n_trajectories=8, duration=5.0, random_state=4
    )
    torque = log.y.copy()
    names = sorted(log.X["trajectory"].unique())[3:]
    later = log.X["trajectory"].isin(names).to_numpy()
    torque[later, 2] += 0.2 * torque[:, 2].std()
    torque[later, 5] -= 0.2 * torque[:, 5].std()

    found = diagnose(RBDRegressor(log.robot), log.X, torque, checks=()).findings

    assert {(f.kind, f.joints) for f in found} == {("offset", (3,)), ("offset", (6,))}
    assert {f.trajectories for f in found} == {tuple(names)}
