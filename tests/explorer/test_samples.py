# SPDX-License-Identifier: BSD-3-Clause
"""The quick held-out residual of every sample is that of fits without its fold, one by one."""

from __future__ import annotations

import numpy as np

from skidyn.effects import TermSum
from skidyn.evidence import left_out_coefficients


def held_out_residual(problem, terms, sigma):
    """Residual of every sample, and the noise of a row of every joint."""
    design = problem.design([problem.term_rows(term) for term in terms])
    whole, left = left_out_coefficients(problem, design, sigma, problem.target)
    residuals = [y - a @ whole for y, a in zip(problem.target, design, strict=True)]
    noise = np.array([np.sqrt(np.mean(r**2)) for r in residuals])
    fold, s = problem.sample_folds(int(np.argmax(problem.rows.counts))), problem.signals
    torque = np.empty_like(problem.torque)
    for f, own in enumerate(left):
        rows = fold == f
        motion = (x[rows] for x in (s.q, s.dq, s.ddq))
        torque[rows] = problem.robot.inverse_dynamics(*motion, parameters=problem.correction(own))
        for term, place in TermSum(terms).slices(len(problem.rigid_index)):
            for j, columns in term.torque_columns(s).items():
                torque[rows, j] += columns[rows] @ own[place]
    return problem.torque - torque, noise


def test_it_is_that_of_the_fits_one_by_one(session):
    problem = session.problem
    given, noise = held_out_residual(problem, session.terms, problem.fit_own().sigma)
    session.add("spring", joint=2)
    now, _ = held_out_residual(problem, session.terms, noise)

    for joint in (1, 2):
        for trajectory in session.trajectories:
            drawn = session.curves(joint, trajectory)
            here = problem.signals.trajectory == trajectory
            at = np.isin(problem.signals.clock, drawn["time"]) & here
            assert at.sum() == len(drawn["time"]) > 50
            for name, expected in (("given", given), ("now", now)):
                shown = np.array(drawn["measured"]) - np.array(drawn[name], dtype=float)
                told = np.isfinite(shown)
                assert told.mean() > 0.5
                limit = 1e-7 * np.abs(problem.torque).max()
                np.testing.assert_allclose(shown[told], expected[at, joint - 1][told], atol=limit)
