# SPDX-License-Identifier: BSD-3-Clause
"""An effect that changes over the log or with the motion is recognized."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.diagnosis import Candidate
from skidyn.diagnosis._constancy import changes
from skidyn.diagnosis._hypothesis import Hypothesis, SearchResult
from skidyn.diagnosis._rule import CHANGE_SHARE
from skidyn.effects import Term, make_terms
from skidyn.evidence import make_problem

ROBOT = load_planar_arm()


@pytest.fixture(scope="module")
def changes_of(motion):
    """Changes of effects that are found on joint 2 where another torque acts there, by kind."""
    rigid = ROBOT.inverse_dynamics(motion.q, motion.dq, motion.ddq)
    noise = 0.05 * np.random.default_rng(0).normal(size=rigid.shape)

    def of(torque, *found, doubted=()):
        measured = rigid + 0.5 * motion.dq + 2.0 * np.sign(motion.dq) + noise
        measured[:, 1] += torque
        terms = make_terms(["viscous", "coulomb"], 2)
        problem = make_problem(motion, measured, robot=ROBOT, rigid_body=True, terms=terms)
        fit = problem.fit([*problem.terms, *found])
        findings = [
            Hypothesis(t.kind, (Candidate(t.kind, t, problem.term_rows(t)),), np.zeros(2), 0.0, 2)
            for t in found
        ]
        result = SearchResult(findings, fit, np.zeros_like(measured), doubted=doubted)
        return changes(problem, result)

    return of


@pytest.fixture(scope="module")
def change_of(changes_of):
    """Change of a spring that is found on joint 2 where another torque acts there."""
    return lambda torque: changes_of(torque, Term("spring", (2,)))["spring"].share


def test_the_same_spring_throughout_does_not_change(motion, change_of):
    assert change_of(3.0 * motion.q[:, 1]) == 0.0


@pytest.mark.parametrize(
    "inside", [lambda m: m.trajectory >= 5, lambda m: m.time - 10.0 * m.trajectory > 3.0]
)
def test_a_spring_of_some_time_changes(motion, change_of, inside):
    assert change_of(3.0 * motion.q[:, 1] * inside(motion)) > CHANGE_SHARE


def test_a_spring_that_stiffens_changes_with_the_motion(motion, change_of):
    assert change_of(3.0 * motion.q[:, 1] ** 3) > CHANGE_SHARE


def test_friction_of_its_joint_that_changes_counts(motion, change_of):
    dry = 1.0 * (motion.trajectory >= 4) * np.sign(motion.dq[:, 1])
    assert change_of(3.0 * motion.q[:, 1] + dry) > CHANGE_SHARE


def test_what_a_withdrawn_name_explained_is_no_change_of_another_effect(motion, changes_of):
    q, dq = motion.q[:, 1], motion.dq[:, 1]
    spring, drag = Term("spring", (2,)), Term("nonlinear_viscous", (2,), {"power": 2.0})
    torque = 3.0 * q + 2.0 * dq * np.abs(dq)
    assert changes_of(torque, spring)["spring"].share > CHANGE_SHARE
    assert changes_of(torque, spring, doubted=(drag,))["spring"].share == 0.0


def test_what_another_formula_of_an_effect_leaves_is_less_sure_to_be_a_second_one(
    motion, changes_of
):
    q, dq = motion.q[:, 1], motion.dq[:, 1]
    spring, drag = Term("spring", (2,)), Term("nonlinear_viscous", (2,), {"power": 2.0})
    both = changes_of(3.0 * q + 0.5 * dq * np.abs(dq), spring, drag)
    assert both["nonlinear_viscous"].instead is both["spring"].instead is None

    cubic = Term("nonlinear_spring", (2,), {"rest": 0.0})
    left = changes_of(3.0 * q + 0.5 * q**3, spring, cubic)
    assert left["nonlinear_spring"].instead == "spring"
