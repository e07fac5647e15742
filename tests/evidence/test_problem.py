# SPDX-License-Identifier: BSD-3-Clause
from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import Term, get_effect
from skidyn.evidence import make_problem


def test_averaging_keeps_the_model_exact(planar_problem):
    made = planar_problem(6)
    fit = made.fit(made.terms)
    np.testing.assert_allclose(fit.coefficients[len(made.rigid_index) :], 0.4, atol=1e-6)


@pytest.mark.parametrize("kind", ["friction_over_position", "function_of_position", "stribeck"])
@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_few_samples_of_a_fast_log_say_nearly_what_all_samples_say(kind, rate, signals_of):
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=4.0, rate=rate)
    signals = signals_of(log.X, log.robot)
    made = make_problem(signals, log.y, robot=log.robot, rigid_body=True, terms=[])
    term = Term(kind, (2,), get_effect(kind).grid(made.signals, (1,))[0])
    quick, exact = made.screening_rows(term)[1], made.term_rows(term)[1]
    named_or_slow = kind == "stribeck" or rate < 200
    tolerance = 0.0 if named_or_slow else 0.005
    assert np.linalg.norm(quick - exact) <= tolerance * np.linalg.norm(exact)


def test_samples_take_the_fold_of_the_nearest_row_of_their_trajectory(planar_problem):
    made = planar_problem(4)
    rows, fold = made.rows, made.fold[0]
    found = made.sample_folds(0)
    for name in np.unique(made.signals.trajectory):
        own, mine = made.signals.trajectory == name, rows.trajectory[0] == name
        distance = np.abs(made.signals.clock[own, None] - rows.time[0][mine])
        nearest = distance <= distance.min(axis=1, keepdims=True) + 1e-9
        folds = np.where(nearest, fold[mine], -1)
        assert (folds == found[own, None]).any(axis=1).all()


def test_what_a_fit_explains_is_computed_again_where_the_fit_or_the_load_changes(planar_problem):
    made, other = planar_problem(6), planar_problem(6)
    gain = Term("torque_gain", (1,))
    fit = made.fit_own()
    first = made.explained(fit)
    np.testing.assert_array_equal(made.explained(fit), first)
    wider = made.fit([*made.terms, gain])
    assert np.any(made.explained(wider) != first)
    other.fit_own()
    before, changed = other.explained(wider), replace(wider, coefficients=1.5 * wider.coefficients)
    other.set_fit(changed)  # the gain acts on the torque of the model
    assert np.any(other.explained(wider) != before)
