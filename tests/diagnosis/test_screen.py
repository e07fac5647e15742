# SPDX-License-Identifier: BSD-3-Clause
"""Held-out errors with every effect that was tried are those of fits one by one."""

import numpy as np
import pytest

from skidyn.evidence import left_out_coefficients


def held_out_errors(problem, terms, blocks, sigma):
    """Squared error of every joint, each fold predicted by a fit to the others."""
    design = problem.design(blocks)
    soft = problem.soft(terms)
    _, left = left_out_coefficients(problem, design, sigma, problem.target, soft=soft)
    pairs = zip(problem.target, design, problem.fold, strict=True)
    return np.array([np.sum((y - np.sum(a * left[fold], axis=1)) ** 2) for y, a, fold in pairs])


def test_errors_are_those_of_fits_one_by_one(missing):
    problem, first = missing.problem, missing.result.findings[0]
    base = problem.fit_own()
    own = [problem.term_rows(term) for term in base.terms]
    start = np.minimum(base.noise, problem.own_noise(base.terms))
    asked = 0
    for effect in (first, *first.others):
        if any(c.term.trajectories is not None for c in effect.candidates):
            continue  # held out in parts of a recording
        terms = [*base.terms, *(c.term for c in effect.candidates)]
        blocks, sigma = [*own, *(c.rows for c in effect.candidates)], start
        for _ in range(2):  # the noise is that of the model with it
            errors = held_out_errors(problem, terms, blocks, sigma)
            sigma = np.sqrt(errors / problem.rows.counts)
        assert effect.errors.sum(axis=0) == pytest.approx(errors, rel=1e-3), effect.kind
        asked += 1
    assert asked >= 6 and first.kind == "spring"
