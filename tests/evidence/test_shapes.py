# SPDX-License-Identifier: BSD-3-Clause
"""Shapes from the grid to the value that explains most."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.effects import Signals, Term, make_terms
from skidyn.evidence import Gain, best_on_grid, make_problem, refine_term

ROBOT = load_planar_arm()
TRUTH = 0.031


@pytest.fixture(scope="module")
def problem():
    t = np.tile(np.arange(0, 12, 0.01), 8)
    run = np.repeat(np.arange(8), 1200)
    speed = np.array([0.9, 1.3]) + 0.1 * run[:, None]
    q, dq = np.sin(speed * t[:, None]), speed * np.cos(speed * t[:, None])
    signals = Signals(q, dq, -(speed**2) * q, run, time=t, robot=ROBOT)
    torque = ROBOT.inverse_dynamics(q, dq, -(speed**2) * q) + 0.5 * dq + 2.0 * np.sign(dq)
    torque[:, 1] += 1.5 * np.exp(-((dq[:, 1] / TRUTH) ** 2)) * np.sign(dq[:, 1])
    torque += 0.02 * np.random.default_rng(0).normal(size=torque.shape)
    terms = make_terms(["viscous", "coulomb"], 2)
    return make_problem(signals, torque, robot=ROBOT, rigid_body=True, terms=terms)


def test_refined_shape_explains_more_than_any_of_the_grid(problem):
    own = [problem.term_rows(t) for t in problem.terms]
    gain = Gain(problem, own, problem.fit_own().noise, problem.target)
    rough = best_on_grid(problem, "stribeck", (1,), gain)
    fine = refine_term(problem, rough, gain)
    value = [gain(problem.term_rows(t), t.lowest) for t in (rough, fine)]
    assert value[1] >= value[0] > 0
    assert fine.shape["vs"] == pytest.approx(TRUTH, rel=0.5)


def test_a_value_far_from_the_grid_is_reached(problem):
    ratio, signals = 3.2, problem.signals
    shaft = 0.2 * (signals.ddq[:, 0] + ratio * signals.ddq[:, 1])
    torque = problem.measured + np.column_stack([shaft, ratio * shaft])
    terms = list(problem.terms)
    coupled = make_problem(signals, torque, robot=ROBOT, rigid_body=False, terms=terms)
    own = [coupled.term_rows(t) for t in coupled.terms]
    gain = Gain(coupled, own, coupled.fit_own().noise, coupled.target)

    rough = Term("coupled_inertia", (1, 2), {"ratio": 1.0})
    fine = refine_term(coupled, rough, gain)

    assert fine.shape["ratio"] == pytest.approx(ratio, rel=0.03)


def test_an_effect_without_a_shape_is_left_as_it_is(problem):
    own = [problem.term_rows(t) for t in problem.terms]
    gain = Gain(problem, own, problem.fit_own().noise, problem.target)
    spring = Term("spring", (2,))
    assert refine_term(problem, spring, gain) is spring


def test_a_forbidden_sign_gains_nothing(problem):
    own = [problem.term_rows(t) for t in problem.terms[:2]]
    gain = Gain(problem, own, problem.fit_own().noise, problem.target)
    rows = {j: -block for j, block in problem.term_rows(Term("coulomb", (2,))).items()}
    assert gain(rows, np.zeros(1)) == -np.inf


@pytest.mark.parametrize(("run", "second"), [(5, 0.0), (3, 4.0)])
def test_the_moment_of_a_change_is_found(problem, run, second):
    signals = problem.signals.with_(time=problem.signals.time + 20.0 * problem.signals.trajectory)
    moment = 20.0 * run + second
    torque = problem.torque - 1.0 * (signals.time >= moment)[:, None] * np.sign(signals.dq)
    changed = make_problem(signals, torque, robot=ROBOT, rigid_body=True, terms=list(problem.terms))
    own = [changed.term_rows(t) for t in changed.terms]
    gain = Gain(changed, own, changed.fit_own().noise, changed.target)
    rough = Term("friction_drift", (1,), {"since": 20.0})

    found = refine_term(changed, rough, gain).shape["since"]

    assert found == pytest.approx(moment, abs=0.1 if second else 1e-9)


def test_the_gain_function_of_a_model_is_made_once(problem):
    own = [problem.term_rows(t) for t in problem.terms]
    sigma, target = np.ones(2), problem.target
    gain = Gain.beside(problem, own, sigma, target)
    assert Gain.beside(problem, own, sigma, target) is gain
    assert Gain.beside(problem, own[:1], sigma, target) is not gain
    noisier = Gain.beside(problem, own[:1], 2 * sigma, target)
    np.testing.assert_array_equal(noisier.sigma, 2 * sigma)
