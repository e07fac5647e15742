# SPDX-License-Identifier: BSD-3-Clause
"""Effects that begin within recordings are found with their times."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.diagnosis._spans import span_candidates
from skidyn.diagnosis._tester import Tester
from skidyn.effects import Signals, get_effect, make_terms
from skidyn.evidence import make_problem
from skidyn.identification import RBDRegressor

ROBOT = load_planar_arm()
KINDS = ("offset", "spring", "payload", "external_wrench")
#: Seconds after its start at which something is hooked on in each of some recordings.
BEGINS = {1: 2.0, 4: 3.5, 6: 1.2}


def found_with(motion, torque):
    """What begins within recordings where a torque is added on joint 2."""
    measured = ROBOT.inverse_dynamics(motion.q, motion.dq, motion.ddq)
    measured += 0.5 * motion.dq + 2.0 * np.sign(motion.dq)
    measured += 0.05 * np.random.default_rng(0).normal(size=measured.shape)
    measured[:, 1] += torque
    terms = make_terms(["viscous", "coulomb"], 2)
    problem = make_problem(motion, measured, robot=ROBOT, rigid_body=True, terms=terms)
    blocks = [problem.term_rows(term) for term in terms]
    tester = Tester(problem, blocks, problem.fit_own().noise, problem.target)
    found = span_candidates(problem, KINDS, tester, lambda chance, _: chance < 1e-6, 30.0)
    drops = [(tester.test(c.rows).drop, c.term) for own in found for c in own]
    return [term for _, term in sorted(drops, key=lambda item: -item[0])]


def since_start(motion):
    """Time since the beginning of its recording of every sample, s."""
    return motion.time - 10.0 * motion.trajectory


def hooked_on(motion):
    begins = np.array([BEGINS.get(run, np.inf) for run in range(8)])
    return since_start(motion) >= begins[motion.trajectory]


def test_a_spring_that_is_hooked_on_is_found_with_its_times(motion):
    best = found_with(motion, 2.0 * motion.q[:, 1] * hooked_on(motion))[0]

    assert (best.kind, best.joints, best.trajectories) == ("spring", (2,), (1, 4, 6))
    for run, start, end in best.spans:
        assert start == pytest.approx(10 * run + BEGINS[run], abs=0.15)
        assert end == pytest.approx(10 * run + 6, abs=0.15)


def test_what_acts_in_whole_recordings_has_no_times(motion):
    assert not found_with(motion, 2.0 * motion.q[:, 1] * np.isin(motion.trajectory, [1, 4, 6]))


def test_nothing_begins_where_nothing_is_hidden(motion):
    assert not found_with(motion, 0.0)


def test_one_recording_does_not_show_that_it_returns(motion):
    assert not found_with(
        motion, 2.0 * motion.q[:, 1] * hooked_on(motion) * (motion.trajectory == 4)
    )


def test_what_is_hooked_on_once_and_stays_is_found_with_its_moment(motion):
    later = motion.time >= 10.0 * 4 + 3.0

    best = found_with(motion, 2.0 * motion.q[:, 1] * later)[0]

    assert (best.kind, best.joints, best.trajectories) == ("spring", (2,), (4, 5, 6, 7))
    ((run, start, end),) = best.spans
    assert (run, start, end) == (4, pytest.approx(43.0, abs=0.15), pytest.approx(46.0, abs=0.15))


@pytest.mark.slow
def test_a_part_that_is_gripped_in_one_recording_is_a_payload_with_its_times():
    log = make_hidden_effect_log(load_ur5(), None, n_trajectories=6, duration=6.0, random_state=4)
    q, dq, ddq = (log.X[[f"{s}{j}" for j in range(1, 7)]].to_numpy() for s in ("q", "dq", "ddq"))
    time, run = log.X["time"].to_numpy(), log.X["trajectory"].to_numpy()
    names = np.unique(run)
    since = time - np.array([time[run == k].min() for k in names])[np.searchsorted(names, run)]
    signals = Signals(q, dq, ddq, run, time=time, robot=log.robot)
    part = get_effect("payload").torque_columns(signals, range(6))
    gripped = (run == names[3]) & (since > 2.4)
    torque = np.array(log.y)
    for j, columns in part.items():
        torque[:, j] += gripped * (columns[:, :4] @ [3.0, 0.0, 0.0, 0.15])

    diagnosis = diagnose(RBDRegressor(log.robot, ("viscous", "coulomb")), log.X, torque)

    (finding,) = diagnosis.findings
    assert (finding.kind, finding.trajectories) == ("payload", (names[3],))
    assert finding.parameters["mass"]["value"] == pytest.approx(3.0, rel=0.2)
    ((_, first, last),) = finding.terms[0].spans
    assert first == pytest.approx(time[gripped].min(), abs=0.3)
    assert last == pytest.approx(time[gripped].max(), abs=0.3)
