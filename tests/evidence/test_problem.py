# SPDX-License-Identifier: BSD-3-Clause
from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import Signals, Term, get_effect, make_terms
from skidyn.evidence import make_problem


def problem(n_trajectories, rate=100.0):
    robot = load_planar_arm()
    t = np.arange(0, 12, 1 / rate)
    parts = []
    for k in range(n_trajectories):
        phase = t[:, None] * [1.1 + 0.1 * k, 1.7]
        w = np.array([1.1 + 0.1 * k, 1.7])
        parts.append((np.sin(phase), w * np.cos(phase), -(w**2) * np.sin(phase)))
    q, dq, ddq = (np.vstack(x) for x in zip(*parts, strict=True))
    label = np.repeat(np.arange(n_trajectories), len(t))
    signals = Signals(q, dq, ddq, label, time=np.tile(t, n_trajectories), robot=robot)
    torque = robot.inverse_dynamics(q, dq, ddq, parameters=1.1 * robot.inertial_parameters)
    terms = make_terms(["viscous"], 2)
    return make_problem(
        signals, torque + 0.4 * dq, robot=robot, rigid_body=True, terms=terms, smooth=False
    )


def test_averaging_keeps_the_model_exact():
    made = problem(6)
    fit = made.fit(made.terms)
    np.testing.assert_allclose(fit.coefficients[len(made.rigid_index) :], 0.4, atol=1e-6)


def test_folds_are_whole_trajectories():
    made = problem(8)
    assert made.whole_trajectories
    for fold, trajectory in zip(made.fold, made.rows.trajectory, strict=True):
        for name in np.unique(trajectory):
            assert len(set(fold[trajectory == name])) == 1


@pytest.mark.parametrize("rate", [100.0, 20.0])
def test_blocks_of_one_trajectory_share_no_sample(rate):
    made = problem(1, rate)
    assert not made.whole_trajectories
    for weights, fold in zip(made.rows.weights, made.fold, strict=True):
        used = [set(np.flatnonzero(abs(weights[fold == f]).sum(0) > 1e-12)) for f in set(fold)]
        assert sum(map(len, used)) == len(set().union(*used))


@pytest.mark.parametrize("kind", ["friction_over_position", "function_of_position", "stribeck"])
@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_few_samples_of_a_fast_log_say_nearly_what_all_samples_say(kind, rate, signals_of):
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=4.0, rate=rate)
    signals = signals_of(log.X, log.robot)
    made = make_problem(signals, log.y, robot=log.robot, rigid_body=True, terms=[])
    term = Term(kind, (2,), get_effect(kind).grid(made.signals, (1,))[0])
    quick, exact = made.screening_rows(term)[1], made.term_rows(term)[1]
    named_or_slow = kind == "stribeck" or rate < 200
    tolerance = 0.0 if named_or_slow else 0.005
    assert np.linalg.norm(quick - exact) <= tolerance * np.linalg.norm(exact)


def test_a_joint_that_slides_for_a_moment_counts_as_one_at_rest(signals_of):
    robot = load_planar_arm()
    log = make_hidden_effect_log(robot, "stribeck", joints=[1], n_trajectories=5, random_state=2)
    frame = log.frame.copy()
    still = frame["trajectory"] > 0
    still |= frame["time"] > frame["time"].min() + 0.5
    frame.loc[still, "dq2"] = 0.0
    names = [f"{quantity}{k}" for quantity in ("q", "dq") for k in (1, 2)]
    signals = signals_of(frame[["time", "trajectory", *names]], robot)
    torque = frame[["tau1", "tau2"]].to_numpy()
    terms = make_terms(["viscous", "coulomb"], 2)
    made = make_problem(signals, torque, robot=robot, rigid_body=True, terms=terms, smooth=False)
    assert made.rows.counts[1] == 0 and made.rows.counts[0] > 100
    assert not made.rows.sliding[:, 1].any()


def test_samples_take_the_fold_of_the_nearest_row_of_their_trajectory():
    made = problem(4)
    rows, fold = made.rows, made.fold[0]
    found = made.sample_folds(0)
    for name in np.unique(made.signals.trajectory):
        own, mine = made.signals.trajectory == name, rows.trajectory[0] == name
        distance = np.abs(made.signals.clock[own, None] - rows.time[0][mine])
        nearest = distance <= distance.min(axis=1, keepdims=True) + 1e-9
        folds = np.where(nearest, fold[mine], -1)
        assert (folds == found[own, None]).any(axis=1).all()


def test_without_a_clock_every_sample_is_a_row():
    made = problem(2)
    signals = made.signals.with_(time=None)
    torque = signals.robot.inverse_dynamics(signals.q, signals.dq, signals.ddq)
    bare = make_problem(
        signals, torque, robot=signals.robot, rigid_body=True, terms=made.terms, smooth=False
    )
    assert bare.rows.counts.tolist() == [signals.n_samples] * 2
    np.testing.assert_array_equal(bare.rows.average(signals.q, 0), signals.q)


def test_what_a_fit_explains_is_computed_again_where_the_fit_or_the_load_changes():
    made, other = problem(6), problem(6)
    gain = Term("torque_gain", (1,))
    fit = made.fit_own()
    first = made.explained(fit)
    np.testing.assert_array_equal(made.explained(fit), first)
    wider = made.fit([*made.terms, gain])
    assert np.any(made.explained(wider) != first)
    other.fit_own()
    before, changed = other.explained(wider), replace(wider, coefficients=1.5 * wider.coefficients)
    other.set_fit(changed)  # the gain acts on the torque of the model
    assert np.any(other.explained(wider) != before)


def test_noise_of_joints_follows_the_torque():
    made = problem(6)
    noise = made.own_noise(made.terms)
    louder = replace(made, torque=made.torque + np.random.default_rng(0).normal(size=(7200, 2)))
    assert np.all(louder.own_noise(made.terms) > 2 * noise)
    np.testing.assert_array_equal(made.own_noise(made.terms), noise)
