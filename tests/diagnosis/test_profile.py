# SPDX-License-Identifier: BSD-3-Clause
"""Shapes are refined from the grid to the truth."""

import numpy as np

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import Settings, catalogue_candidates, diagnose, refine
from skidyn.evidence import Gain
from skidyn.identification import RBDRegressor


def test_a_refined_shape_explains_more_and_is_nearer_the_truth():
    log = make_hidden_effect_log(load_planar_arm(), "stribeck", joints=[2], random_state=3)
    problem = diagnose(
        RBDRegressor(log.robot), log.X, log.y, settings=Settings(max_findings=0), checks=()
    ).problem
    fit = problem.fit_own()
    own, target = [problem.term_rows(t) for t in problem.terms], problem.target
    gain = Gain(problem, own, fit.noise, target)
    pool = [c for c in catalogue_candidates(problem, ["stribeck"]) if c.joints == (1,)]
    rough = max(pool, key=lambda c: gain(c.rows, c.term.lowest))

    (fine,) = refine(problem, own, [rough], fit.noise, target)

    assert gain(fine.rows, fine.term.lowest) >= gain(rough.rows, rough.term.lowest)
    true = float(np.ravel(log.parameters["vs"])[0])
    assert abs(np.log(fine.term.shape["vs"] / true)) < 0.5
