# SPDX-License-Identifier: BSD-3-Clause
"""The autocorrelation of what is left."""

import numpy as np

from skidyn.diagnosis import variance_inflation


def test_white_rows_have_no_inflation_and_slow_ones_much(missing):
    problem, rng = missing.problem, np.random.default_rng(0)
    white = [rng.normal(size=n) for n in problem.rows.counts]
    slow = [np.sin(problem.rows.time[j]) for j in range(problem.n_joints)]
    both = range(problem.n_joints)
    assert (variance_inflation(problem, white, both) < 2).all()
    assert (variance_inflation(problem, slow, both) > 5).all()
