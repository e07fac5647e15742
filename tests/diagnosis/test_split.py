# SPDX-License-Identifier: BSD-3-Clause
"""Loads that some recordings have."""

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import Settings, diagnose, split_effects
from skidyn.identification import RBDRegressor


def test_the_recordings_with_a_payload_are_told_from_the_others():
    log = make_hidden_effect_log(load_planar_arm(), "payload", random_state=2)
    compared = diagnose(RBDRegressor(log.robot), log.X, log.y, settings=Settings(max_findings=0))
    problem = compared.problem
    fit = problem.fit_own()
    own = [problem.term_rows(t) for t in problem.terms]

    (split,) = split_effects(problem, ["payload", "spring"], own, fit.noise, problem.target)

    assert split.candidate.term.trajectories == tuple(sorted(log.parameters["trajectories"]))
    assert (split.drop > 0).all()  # in every quarter of the recordings
