# SPDX-License-Identifier: BSD-3-Clause
"""Effects whose size changes steadily are found with their sizes."""

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.diagnosis import diagnose
from skidyn.diagnosis._courses import course_candidates
from skidyn.diagnosis._tester import Tester
from skidyn.effects import make_terms
from skidyn.evidence import make_problem
from skidyn.identification import RBDRegressor

ROBOT = load_planar_arm()
KINDS = ("offset", "spring", "payload", "torque_gain")
#: A load of 1 kg in the middle of the second link.
LOAD = np.array([1.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.1])


def measured_with(motion, torque):
    """Torque of the arm with friction and noise, and another torque."""
    measured = ROBOT.inverse_dynamics(motion.q, motion.dq, motion.ddq)
    measured += 0.5 * motion.dq + 2.0 * np.sign(motion.dq)
    return measured + 0.05 * np.random.default_rng(0).normal(size=measured.shape) + torque


def found_with(motion, torque):
    """What changes steadily where a torque is added."""
    terms = make_terms(["viscous", "coulomb"], 2)
    measured = measured_with(motion, torque)
    problem = make_problem(motion, measured, robot=ROBOT, rigid_body=True, terms=terms)
    blocks = [problem.term_rows(term) for term in terms]
    tester = Tester(problem, blocks, problem.fit_own().noise, problem.target)

    def possible(candidate):
        return candidate.allows(tester.test(candidate.rows).coefficients)

    found = course_candidates(
        problem, KINDS, tester, possible, lambda chance, _: chance < 1e-6, 30.0
    )
    drops = [(tester.test(c.rows).drop, c.term) for own in found for c in own]
    return [term for _, term in sorted(drops, key=lambda item: -item[0])]


def passed(motion):
    """Share of its recording that has passed at every sample."""
    return (motion.time - 10.0 * motion.trajectory) / 6.0


def of_load(motion):
    return ROBOT.torque_regressor(motion.q, motion.dq, motion.ddq)[:, :, -10:] @ LOAD


def test_an_offset_that_grows_over_the_log_is_found(motion):
    grown = (motion.trajectory + passed(motion)) / 8

    best = found_with(motion, np.column_stack([0 * grown, 0.4 * grown]))[0]

    assert (best.kind, best.joints, best.trajectories) == ("offset", (2,), None)
    # what is constant may be part of the bodies
    assert best.course[-1][-1] == 1.0
    assert best.course[0][2] < 0.2


def test_a_load_that_empties_in_some_recordings_is_found_with_its_sizes(motion):
    carried = np.isin(motion.trajectory, [2, 3, 6]) * (1 - 0.6 * passed(motion))

    best = found_with(motion, of_load(motion) * carried[:, None])[0]

    assert (best.kind, best.trajectories) == ("payload", (2, 3, 6))
    for (_, _, full, _, left), run in zip(best.course, (2, 3, 6), strict=True):
        assert full == 1.0
        assert left == pytest.approx(0.4, abs=0.05), run


def test_a_load_that_empties_in_every_recording_falls_and_does_not_become_negative(motion):
    best = found_with(motion, of_load(motion) * (1 - passed(motion))[:, None])[0]

    assert (best.kind, best.trajectories) == ("payload", None)
    assert {sizes[2::2] for sizes in best.course} == {(1.0, 0.0)}


def test_what_is_constant_is_not_changing(motion):
    torque = np.column_stack([0 * motion.time, np.full(len(motion.time), 0.4)])

    assert not found_with(motion, torque)


def test_nothing_changes_where_nothing_is_hidden(motion):
    assert not found_with(motion, 0.0)


@pytest.mark.slow
def test_the_diagnosis_states_how_it_changes(motion):
    carried = np.isin(motion.trajectory, [2, 3, 6]) * (1 - 0.6 * passed(motion))
    measured = measured_with(motion, of_load(motion) * carried[:, None])
    columns = {"time": motion.time, "trajectory": motion.trajectory}
    for name in ("q", "dq", "ddq"):
        columns |= {f"{name}{j + 1}": x for j, x in enumerate(getattr(motion, name).T)}
    model = RBDRegressor(ROBOT, ("viscous", "coulomb"))

    diagnosis = diagnose(model, pd.DataFrame(columns), measured, checks=())

    (finding,) = diagnosis.findings
    assert finding.kind == "payload"
    assert "falls steadily over each recording, from the stated size to" in finding.sentence
    assert finding.parameters["mass"]["value"] == pytest.approx(1.0, rel=0.1)


def test_a_load_that_most_recordings_carry_grows_in_these_and_not_in_the_others(motion):
    """The identified bodies have taken the mean of it, so that the others differ more."""
    carrying = (0, 1, 3, 5, 7)
    carried = np.isin(motion.trajectory, carrying) * (0.2 + 0.8 * passed(motion))

    best = found_with(motion, of_load(motion) * carried[:, None])[0]

    assert (best.kind, best.trajectories) == ("payload", carrying)
    assert best.course[0][2] == pytest.approx(0.2, abs=0.06)
