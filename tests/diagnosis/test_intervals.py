# SPDX-License-Identifier: BSD-3-Clause
"""Intervals of parameters by leaving folds out."""

import numpy as np
import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose, parameter_intervals
from skidyn.identification import RBDRegressor


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


@pytest.mark.slow
def test_a_fine_ripple_has_narrow_intervals_of_its_waves_and_size():
    # a wave of 60 periods per rad is another one at waves that differ by two per cent
    log = make_hidden_effect_log(
        load_ur5(), "torque_ripple", joints=[2], n_trajectories=8, duration=8.0, random_state=2
    )
    model = RBDRegressor(log.robot)
    diagnosis = diagnose(model, log.X, log.y, effects=["torque_ripple"], checks=())
    (ripple,) = diagnosis.findings
    waves, size = (ripple.parameters[name] for name in ("N", "A"))
    assert waves["low"] < 60 < waves["high"] and waves["high"] - waves["low"] < 0.1
    assert size["high"] - size["low"] < 0.1 * size["value"]
