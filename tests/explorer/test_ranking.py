# SPDX-License-Identifier: BSD-3-Clause
"""What is said about an effect is what the fit with it gives."""

from __future__ import annotations

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.evidence import left_out_coefficients
from skidyn.explorer import Session
from skidyn.identification import RBDRegressor


def held_out_error(session, joint):
    """Squared error of the averaged rows of a joint, each fold predicted by a fit to the others."""
    problem, j = session.problem, joint - 1
    design = problem.design([problem.term_rows(term) for term in session.terms])
    sigma = problem.fit_own().sigma
    _, left = left_out_coefficients(problem, design, sigma, problem.target)
    predicted = np.sum(design[j] * left[problem.fold[j]], axis=1)
    return np.sum((problem.target[j] - predicted) ** 2)


def test_the_error_with_an_effect_is_that_of_the_model_fitted_with_it(session):
    asked = 0
    for joint in (1, 2):
        given = held_out_error(session, joint)
        # a load in some recordings is held out in parts of them
        for ranked in (r for r in session.ranked(joint) if not r.trajectories):
            session.add(ranked.kind, joint, refined=False)
            drop = 1 - held_out_error(session, joint) / given
            assert ranked.drop == pytest.approx(drop, rel=1e-3), ranked.kind
            session.undo()
            asked += 1
    assert asked >= 6


def test_what_physics_forbids_is_not_offered():
    """A spring that pushes away from its rest would have a negative stiffness."""
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=4)
    offered = []
    for stiffness in (3.0, -3.0):
        y = log.y + stiffness * log.X[["q1", "q2"]].to_numpy() * [0, 1]
        session = Session(RBDRegressor(log.robot), log.X, y)
        offered.append({ranked.kind: ranked.drop for ranked in session.ranked(joint=2)})
    assert offered[0]["spring"] > 0.9
    assert "spring" not in offered[1]
