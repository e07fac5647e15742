# SPDX-License-Identifier: BSD-3-Clause
"""Friction that builds up over a thousandth of a radian shows only close to reversals."""

from __future__ import annotations

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.effects import dahl_state
from skidyn.identification import RBDRegressor


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(load_planar_arm(), None, random_state=3)


@pytest.fixture(scope="module")
def diagnosis(log):
    runs = log.X.groupby("trajectory").indices.values()
    rows = [slice(run[0], run[-1] + 1) for run in runs]
    state = dahl_state(log.X["q1"].to_numpy(), rows, presliding=0.004)
    torque = np.array(log.y)
    torque[:, 0] += 2.0 * state
    return diagnose(RBDRegressor(log.robot), log.X, torque, checks=())


def test_hysteresis_of_a_short_way_is_found_on_its_joint(diagnosis):
    assert [f.joints for f in diagnosis.findings] == [(1,)]
    assert diagnosis.findings[0].kind in {"dahl", "lugre", "maxwell_slip"}


def test_its_way_is_measured_by_a_model_that_reaches_up_to_the_reversals(diagnosis):
    model = diagnosis.base_model.with_effects([("dahl", [1])]).fit(*diagnosis.data)

    (term,) = [t for t in model.effect_terms_ if t.kind == "dahl"]
    assert term.shape["presliding"] == pytest.approx(0.004, rel=0.5)


def test_a_joint_that_sticks_at_reversals_is_no_hysteresis(log):
    found = diagnose(RBDRegressor(log.robot), log.X, log.y, checks=())

    assert found.verdict == "complete"
