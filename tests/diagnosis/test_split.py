# SPDX-License-Identifier: BSD-3-Clause
"""Loads that some recordings have."""

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_panda, load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import Settings, diagnose, split_effects
from skidyn.identification import RBDRegressor

#: What may differ from recording to recording, beside what acts in all of them.
KINDS = ("payload", "external_wrench", "offset", "coulomb", "spring")


def diagnosed(log, torque):
    """The log is as it should be: no test looks at its checks."""
    return diagnose(RBDRegressor(log.robot), log.X, torque, effects=KINDS, checks=())


def test_the_recordings_with_a_payload_are_told_from_the_others():
    log = make_hidden_effect_log(load_planar_arm(), "payload", random_state=2)
    compared = diagnose(
        RBDRegressor(log.robot), log.X, log.y, settings=Settings(max_findings=0), checks=()
    )
    problem = compared.problem
    fit = problem.fit_own()
    own = [problem.term_rows(t) for t in problem.terms]

    split, _ = split_effects(problem, ["payload", "spring"], own, fit.noise, problem.target)

    assert split.candidate.term.trajectories == tuple(sorted(log.parameters["trajectories"]))
    assert (split.drop > 0).all()  # in every quarter of the recordings


@pytest.mark.slow
@pytest.mark.parametrize("frame", ["", "tool_"])
def test_a_force_beside_the_origin_of_the_tool_is_told_with_its_moment_and_frame(frame):
    log = make_hidden_effect_log(
        load_panda(), None, noise="low", n_trajectories=4, duration=4.0, random_state=0
    )
    own = (log.X["trajectory"] == 3).to_numpy()
    q = log.X[[f"q{j + 1}" for j in range(7)]].to_numpy()[own]
    wrench = np.array([8.0, -3.0, 5.0, 0.4, 0.3, -0.5])
    acting = np.broadcast_to(wrench.reshape(2, 3), (len(q), 2, 3))
    if frame:
        turned = log.robot.forward_kinematics(q)[1]
        acting = np.einsum("iab,ikb->ika", turned, acting)
    torque = log.y.copy()
    torque[own] -= np.einsum("iaj,ia->ij", log.robot.jacobian(q), acting.reshape(-1, 6))

    (found,) = diagnosed(log, torque).findings

    assert (found.kind, found.trajectories) == ("external_wrench", (3,))
    names = [f"{frame}{what}_{a}" for what in ("force", "moment") for a in "xyz"]
    told = [found.parameters[name]["value"] for name in names]
    np.testing.assert_allclose(told, wrench, atol=0.2)
    assert all(f"{name} = " in found.sentence for name in names[:3])
    assert ("turns with the tool" in found.sentence) == bool(frame)


@pytest.mark.slow
def test_a_force_may_act_in_most_recordings():
    log = make_hidden_effect_log(
        load_ur5(), None, noise="low", n_trajectories=7, duration=4.0, random_state=0
    )
    most = tuple(log.X["trajectory"].unique()[::2].tolist())
    own = log.X["trajectory"].isin(most).to_numpy()
    jacobian = log.robot.jacobian(log.X[[f"q{j + 1}" for j in range(6)]].to_numpy()[own])
    torque = log.y.copy()
    torque[own] -= np.einsum("iaj,a->ij", jacobian[:, :3], [3.0, 0.0, -2.0])

    (found,) = diagnosed(log, torque).findings

    assert (found.kind, found.trajectories) == ("external_wrench", most)


@pytest.mark.slow
def test_another_load_is_one_of_other_recordings():
    # two thirds of the recordings carry one, so that each has its own size only if all are needed
    log = make_hidden_effect_log(
        load_panda(), None, noise="low", n_trajectories=6, duration=4.0, random_state=0
    )
    X, torque = log.X, log.y.copy()
    motion = [X[[f"{name}{j + 1}" for j in range(7)]].to_numpy() for name in ("q", "dq", "ddq")]
    load = np.array([1.0, 0.02, 0.0, 0.05, 0.003, 0.0, 0.0, 0.003, 0.0, 0.001])
    loads = {(1, 4): 0.9, (2, 5): 0.4}  # kg
    for recordings, mass in loads.items():
        bodies = log.robot.inertial_parameters.copy()
        change = -log.robot.inverse_dynamics(*motion, parameters=bodies)
        bodies[-1] += mass * load
        change += log.robot.inverse_dynamics(*motion, parameters=bodies)
        own = X["trajectory"].isin(recordings).to_numpy()
        torque[own] += change[own]

    found = diagnosed(log, torque).findings

    carried = {k: f.parameters["mass"]["value"] for f in found for k in f.trajectories}
    assert {f.kind for f in found} == {"payload"}
    expected = {k: mass for recordings, mass in loads.items() for k in recordings}
    assert carried == pytest.approx(expected, rel=0.05)
    assert {f.trajectories for f in found} == set(loads)


@pytest.mark.slow
def test_a_payload_of_another_link_is_one_and_not_a_zero_of_its_joint():
    log = make_hidden_effect_log(
        load_ur5(), None, noise="low", n_trajectories=8, duration=5.0, random_state=1
    )
    robot, X = log.robot, log.X
    heavier = robot.inertial_parameters.copy()
    mass, center = 1.5, np.array([0.08, 0.0, -0.03])
    heavier[3, :4] += mass * np.r_[1.0, center]
    motion = [X[[f"{name}{j + 1}" for j in range(6)]] for name in ("q", "dq", "ddq")]
    added = robot.inverse_dynamics(*motion, parameters=heavier) - robot.inverse_dynamics(*motion)
    carries = X["trajectory"].isin([2, 5, 6]).to_numpy()

    diagnosis = diagnose(RBDRegressor(robot), X, log.y + added * carries[:, None])

    (finding,) = diagnosis.findings
    assert (finding.kind, finding.joints) == ("payload", (4,))
    assert finding.trajectories == (2, 5, 6)
    assert finding.to_dict()["form"] == {"link": 3}
    assert abs(finding.parameters["mass"]["value"] - mass) < 0.1
    assert not [check for check in diagnosis.checks if check.certainty != "noted"]
    better = diagnosis.add("payload", joints=[4])
    assert [term.form for term in better.effect_terms_ if term.kind == "payload"] == [{"link": 3}]


@pytest.mark.parametrize("seed", [1, pytest.param(4, marks=pytest.mark.slow)])
def test_a_force_is_found_in_recordings_in_which_a_single_joint_moves(seed):
    """Their own estimates of the force are arbitrary, but their torque tells whether it acts."""
    rng, robot, acting = np.random.default_rng(seed), load_panda(), (1, 2, 7)
    time, motions, torques = np.arange(0, 5, 0.01), [], []
    middle = np.array([0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0])
    for k in range(9):
        frequency, phase, size = (
            rng.uniform(*r, (7, 3)) for r in ((0.1, 0.5), (0, 6.3), (0.1, 0.4))
        )
        if k < 7:
            size[np.arange(7) != k] = 0.0
        rate = 2 * np.pi * frequency
        waves = [np.sin(rate * time[:, None, None] + phase + turn) for turn in (0, np.pi / 2)]
        q = middle + rng.uniform(-0.6, 0.6, 7) + (size * waves[0]).sum(2)
        dq, ddq = (size * rate * waves[1]).sum(2), -(size * rate**2 * waves[0]).sum(2)
        torque = robot.inverse_dynamics(q, dq, ddq) + rng.normal(0, 0.6, q.shape)
        if k in acting:
            torque -= np.einsum("iaj,a->ij", robot.jacobian(q)[:, :3], [1.3, 4.0, -2.7])
        names = [f"{name}{j}" for name in ("q", "dq", "ddq") for j in range(1, 8)]
        motion = pd.DataFrame(np.hstack([q, dq, ddq]), columns=names)
        motions.append(motion.assign(time=time + 6 * k, trajectory=k))
        torques.append(torque)
    X = pd.concat(motions, ignore_index=True)

    found = diagnose(RBDRegressor(robot), X, np.vstack(torques), effects=KINDS, checks=()).findings

    assert [(f.kind, f.trajectories) for f in found] == [("external_wrench", acting)]
