# SPDX-License-Identifier: BSD-3-Clause
"""Intervals of parameters by leaving folds out."""

import numpy as np

from skidyn.diagnosis import parameter_intervals


def test_intervals_lie_around_the_fit_and_hold_the_truth(missing, spring_log):
    problem, terms = missing.problem, list(missing.result.fit.terms)
    found = parameter_intervals(problem, terms, missing.result.fit.noise)
    (spring,) = [t for t in terms if t.kind == "spring"]
    value, low, high = found[spring]["k"]
    assert low < value < high
    assert low < float(np.ravel(spring_log.parameters["k"])[0]) < high


def test_shapes_that_are_held_make_intervals_no_wider(missing):
    problem, terms = missing.problem, list(missing.result.fit.terms)
    noise = missing.result.fit.noise
    free, held = (parameter_intervals(problem, terms, noise, shapes) for shapes in (True, False))
    for term in terms:
        for name, interval in held[term].items():
            if isinstance(interval, tuple):
                wide = free[term][name]
                assert interval[2] - interval[1] <= 1.01 * (wide[2] - wide[1])
