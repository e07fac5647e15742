# SPDX-License-Identifier: BSD-3-Clause
"""Shapes of effects that were left open are found with the fit."""

import numpy as np

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import Term
from skidyn.identification import RBDRegressor


def test_an_open_shape_is_found_and_a_given_one_kept():
    log = make_hidden_effect_log(load_planar_arm(), "stribeck", joints=[2], random_state=3)
    open_ = RBDRegressor(log.robot, ("viscous", "coulomb", ("stribeck", [2]))).fit(log.X, log.y)
    (found,) = [t.shape["vs"] for t in open_.effect_terms_ if t.kind == "stribeck"]
    assert abs(np.log(found / float(np.ravel(log.parameters["vs"])[0]))) < 0.5

    given = Term("stribeck", (2,), {"vs": 0.4})
    closed = RBDRegressor(log.robot, ("viscous", "coulomb", given)).fit(log.X, log.y)
    assert ("stribeck", 0.4) in [(t.kind, t.shape.get("vs")) for t in closed.effect_terms_]
    assert open_.score(log.X, log.y) > closed.score(log.X, log.y)
