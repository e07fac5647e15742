# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import make_terms
from skidyn.evidence import make_problem


def test_folds_are_whole_trajectories(planar_problem):
    made = planar_problem(8)
    assert made.whole_trajectories
    for fold, trajectory in zip(made.fold, made.rows.trajectory, strict=True):
        for name in np.unique(trajectory):
            assert len(set(fold[trajectory == name])) == 1


@pytest.mark.parametrize("rate", [100.0, 20.0])
def test_blocks_of_one_trajectory_share_no_sample(planar_problem, rate):
    made = planar_problem(1, rate)
    assert not made.whole_trajectories
    for weights, fold in zip(made.rows.weights, made.fold, strict=True):
        used = [set(np.flatnonzero(abs(weights[fold == f]).sum(0) > 1e-12)) for f in set(fold)]
        assert sum(map(len, used)) == len(set().union(*used))


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


def test_without_a_clock_every_sample_is_a_row(planar_problem):
    made = planar_problem(2)
    signals = made.signals.with_(time=None)
    torque = signals.robot.inverse_dynamics(signals.q, signals.dq, signals.ddq)
    bare = make_problem(
        signals, torque, robot=signals.robot, rigid_body=True, terms=made.terms, smooth=False
    )
    assert bare.rows.counts.tolist() == [signals.n_samples] * 2
    np.testing.assert_array_equal(bare.rows.average(signals.q, 0), signals.q)
