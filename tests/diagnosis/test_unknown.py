# SPDX-License-Identifier: BSD-3-Clause
"""Something no name fits: its signals by test, its shape, a formula that can be adopted."""

from __future__ import annotations

import json

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.exceptions import EffectError
from skidyn.identification import RBDRegressor

#: What the simulator hides, the signals it depends on, and the formula of its torque.
HIDDEN = {
    "unknown_cross_drag": ({"dq1", "dq2"}, "dq1 * abs(dq2)", "c"),
    "unknown_pose_friction": ({"dq1", "q2"}, "sin(q2) * sign(dq1)", "a"),
    "unknown_cable": ({"q1", "q2"}, "cos(q1 - q2)", "a"),
}


@pytest.fixture(scope="module", params=HIDDEN)
def case(request):
    log = make_hidden_effect_log(load_planar_arm(), request.param, random_state=5)
    return request.param, log, diagnose(RBDRegressor(log.robot), log.X, log.y)


def test_the_signals_are_those_the_torque_depends_on(case):
    name, log, diagnosis = case

    assert diagnosis.verdict == "unknown"
    assert {j for f in diagnosis.findings for j in f.joints} == set(log.joints)
    for finding in diagnosis.findings:
        assert set(finding.variables) == HIDDEN[name][0]
    for torque in diagnosis.unknowns:
        assert set(torque.variables) == HIDDEN[name][0]
        for test in torque.tests:
            assert test.needed == (test.variable in torque.variables)
            assert test.p_value < 0.01 if test.needed else test.share < 0.05


def test_a_formula_is_proposed_and_adopted_with_one_call(case):
    name, log, diagnosis = case
    _, expected, size = HIDDEN[name]

    proposal = diagnosis.unknowns[0].proposal
    assert proposal.expressions == (expected,)
    assert proposal.coefficients[0] == pytest.approx(log.parameters[size], rel=0.03)
    assert proposal.text in diagnosis.findings[0].sentence

    model = diagnosis.add("formula")

    residual = np.asarray(log.y) - model.predict(log.X)
    sliding = diagnosis.comparison.sliding
    error = np.sqrt(np.where(sliding, residual**2, 0).sum(0) / sliding.sum(0))
    assert np.all(error < 1.1 * diagnosis.rmse_after)


def test_the_shape_is_a_map_with_a_band_that_holds_the_truth(case):
    name, log, diagnosis = case
    torque = diagnosis.unknowns[0]
    shape = torque.shape
    seen = np.isfinite(shape["value"])

    assert shape["value"].shape == (16, 16)
    assert seen.mean() > 0.3
    assert np.all(shape["low"][seen] <= shape["value"][seen])
    middle = [(e[1:] + e[:-1]) / 2 for e in shape["edges"]]
    grid = dict(zip(shape["variables"], np.meshgrid(*middle, indexing="ij"), strict=True))
    truth = eval(HIDDEN[name][1], {"sign": np.sign, "sin": np.sin, "cos": np.cos, "abs": abs}, grid)
    size = np.corrcoef(truth[seen], shape["value"][seen])[0, 1]
    assert size > 0.9


def test_the_report_holds_tests_shape_and_formula(case):
    _, _, diagnosis = case

    text = json.dumps(diagnosis.to_dict(), allow_nan=False)

    (first, *_) = json.loads(text)["unexplained"]["torques"]
    assert first["formula"]["text"] == diagnosis.unknowns[0].proposal.text
    assert len(first["shape"]["value"]) == 16
    assert {t["variable"] for t in first["tests"] if t["needed"]} == set(first["variables"])


def test_a_torque_periodic_in_time_gets_its_wave_as_formula():
    log = make_hidden_effect_log(load_planar_arm(), "unknown_clock", random_state=5)

    diagnosis = diagnose(RBDRegressor(log.robot), log.X, log.y)

    (torque,) = diagnosis.unknowns
    assert torque.variables == ("time",)
    assert all("* t)" in e for e in torque.proposal.expressions)
    assert f"{2 * np.pi * log.parameters['frequency']:.2g}" in torque.proposal.text


def test_where_nothing_is_unknown_there_is_no_formula_to_add():
    log = make_hidden_effect_log(load_planar_arm(), None)
    diagnosis = diagnose(RBDRegressor(log.robot), log.X, log.y)

    with pytest.raises(EffectError, match="no formula"):
        diagnosis.add("formula")
