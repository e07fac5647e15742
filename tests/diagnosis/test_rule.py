# SPDX-License-Identifier: BSD-3-Clause
"""Chance and the autocorrelation of what is left."""

import numpy as np
import pytest

from skidyn.diagnosis import diagnose, variance_inflation


def test_white_rows_have_no_inflation_and_slow_ones_much(missing):
    problem, rng = missing.problem, np.random.default_rng(0)
    white = [rng.normal(size=n) for n in problem.rows.counts]
    slow = [np.sin(problem.rows.time[j]) for j in range(problem.n_joints)]
    both = range(problem.n_joints)
    assert (variance_inflation(problem, white, both) < 2).all()
    assert (variance_inflation(problem, slow, both) > 5).all()


def test_thresholds_of_another_kind_are_refused(spring_log, missing):
    with pytest.raises(ValueError, match=r"expected Settings"):
        diagnose(missing.base_model, spring_log.X, spring_log.y, settings={"level": 0.1})
