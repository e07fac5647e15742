# SPDX-License-Identifier: BSD-3-Clause
"""The model of a session as given."""

from __future__ import annotations

import numpy as np

from skidyn.diagnosis import Settings, diagnose
from skidyn.explorer import Session
from skidyn.identification import RBDRegressor


def test_errors_are_those_of_a_diagnosis(session, log):
    only = Settings(max_findings=0)
    given = diagnose(session.model, log.X, log.y, settings=only, checks=()).rmse_before

    np.testing.assert_allclose(session.history[0]["rmse"], given, rtol=1e-6)


def test_effects_with_a_shape_may_be_in_the_model_from_the_start(log):
    session = Session(RBDRegressor(log.robot, ("viscous", "coulomb", "stribeck")), log.X, log.y)

    assert [t.shape for t in session.terms if t.kind == "stribeck"] != [{}, {}]
    assert session.ranked(joint=2)[0].kind == "spring"


def test_it_opens_on_the_joint_with_the_largest_error_over_its_noise(session):
    assert session.worst == 2
    assert (session.noise > 0).all()
    assert (session.noise <= 1.2 * np.array(session.history[0]["rmse"])).all()
