# SPDX-License-Identifier: BSD-3-Clause
"""Lines in the spectrum over the angle."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_scara, make_hidden_effect_log
from skidyn.diagnosis import diagnose, find_lines
from skidyn.identification import RBDRegressor


def test_a_ripple_is_found_with_its_waves_and_size(missing):
    problem = missing.problem
    q, rng = problem.signals.q, np.random.default_rng(0)
    residual = 0.05 * rng.normal(size=q.shape)
    residual[:, 1] += 0.2 * np.sin(53.02 * q[:, 1] + 0.3)

    best = min(find_lines(problem, residual), key=lambda line: line.chance)

    assert best.joint == 1 and best.chance < 1e-9
    assert abs(best.term.shape["N"] - 53.02) < 0.01
    assert np.abs(best.torque).max() == pytest.approx(0.2, rel=0.1)


def test_noise_has_no_line(missing):
    residual = np.random.default_rng(1).normal(size=missing.problem.signals.q.shape)
    assert all(line.chance > 1e-3 for line in find_lines(missing.problem, residual))


def test_fewer_than_two_waves_within_the_motion_are_no_ripple(missing):
    problem = missing.problem
    few = 1.5 * 2 * np.pi / np.ptp(problem.signals.q[:, 1])
    q = problem.signals.q * (few / 9.0)  # so that 9 waves a rad are one and a half
    narrow = replace(problem, signals=problem.signals.with_(q=q))
    residual = 0.05 * np.random.default_rng(0).normal(size=q.shape)
    residual[:, 1] += 0.2 * np.sin(9.0 * q[:, 1])

    lines = [line for line in find_lines(narrow, residual) if line.joint == 1]

    assert all(line.term.shape["N"] * np.ptp(q[:, 1]) > 3.9 * np.pi for line in lines)


def test_a_ripple_of_which_few_waves_lie_within_the_motion_has_their_number(missing):
    problem = missing.problem
    q, rng = problem.signals.q, np.random.default_rng(0)
    many = 3.2 * 2 * np.pi / np.ptp(q[:, 1])
    residual = 0.01 * rng.normal(size=q.shape)
    residual[:, 1] += 0.2 * np.sin(many * q[:, 1])
    bodies = np.column_stack([np.ones(len(q)), np.sin(q[:, 1]), np.cos(q[:, 1]), q[:, 1]])
    taken = np.linalg.lstsq(bodies, residual[:, 1], rcond=None)[0]
    residual[:, 1] -= bodies @ taken

    (line,) = [line for line in find_lines(problem, residual) if line.joint == 1][:1]

    assert line.term.shape["N"] == pytest.approx(many, rel=0.003)


def test_a_ball_screw_is_named_with_its_lead():
    log = make_hidden_effect_log(
        load_scara(), None, noise="low", n_trajectories=6, duration=4.0, random_state=0
    )
    slider = log.robot.joint_types.index("prismatic")
    torque = log.y.copy()
    wave = np.sin(2 * np.pi / 0.005 * log.X[f"q{slider + 1}"].to_numpy())
    torque[:, slider] += 0.3 * np.std(torque[:, slider]) * wave

    (found,) = diagnose(RBDRegressor(log.robot), log.X, torque).findings

    assert (found.kind, found.joints) == ("torque_ripple", (slider + 1,))
    assert found.parameters["N"]["value"] == pytest.approx(2 * np.pi / 0.005, rel=0.01)
    assert found.parameters["N"]["unit"] == "1/m"
