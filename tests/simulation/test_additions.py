# SPDX-License-Identifier: BSD-3-Clause
"""Additions to a model, judged by the motion along recordings that no fit has seen."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor
from skidyn.simulation import Controller, judge_additions, servo_torque

FRICTION = ("viscous", "coulomb")


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(
        load_planar_arm(), "spring", joints=[1], n_trajectories=4, duration=3.0, random_state=0
    )


@pytest.fixture(scope="module")
def diagnosis(log):
    return diagnose(RBDRegressor(log.robot, FRICTION), log.X, log.y, checks=())


class Backwards(RBDRegressor):
    """A model whose spring pushes where it should pull: right in no motion."""

    def fit(self, X, y, **more):
        super().fit(X, y, **more)
        for term in self.effect_terms_:
            if term.kind == "spring":
                self.effect_coefficients_[term] = -self.effect_coefficients_[term]
        return self


@pytest.mark.slow
def test_the_wrong_sign_of_the_true_effect_worsens_and_is_not_kept(log):
    wrong, idle = judge_additions(
        Backwards(log.robot, FRICTION),
        [[("spring", [1])], [("offset", [2])]],
        log.X,
        log.y,
        horizon=0.5,
    )
    assert wrong.worsens and "grows" in wrong.text
    assert idle.before.score < wrong.after.score, "judged without what has worsened the motion"


@pytest.mark.slow
def test_pieces_of_one_recording_are_left_out_where_there_is_one(log):
    one = (log.frame["trajectory"] == 1).to_numpy()
    X = log.X[one].drop(columns="trajectory")
    (verdict,) = judge_additions(
        RBDRegressor(log.robot, FRICTION), [[("spring", [1])]], X, log.y[one], horizon=0.5
    )
    assert len(verdict.before.pieces) > 4 and not verdict.worsens


def test_what_simulation_cannot_tell_is_none(log):
    some = (log.frame["trajectory"] <= 2).to_numpy()
    rng = np.random.default_rng(0)
    noise = rng.normal(size=log.y[some].shape) * 50 * np.std(log.y)
    verdicts = judge_additions(
        RBDRegressor(log.robot, FRICTION), [[("spring", [1])]], log.X[some], noise, horizon=1.0
    )
    assert verdicts == [None]
    with pytest.raises(SkidynError, match="not a table"):
        judge_additions(RBDRegressor(log.robot, FRICTION), [], log.X.to_numpy(), log.y)


@pytest.mark.slow
def test_a_diagnosis_keeps_what_helps_and_tells_what_does_not(log, diagnosis):
    kinds = [finding.kind for finding in diagnosis.findings]
    assert kinds == ["spring"]
    given, diagnosis.base_model = diagnosis.base_model, Backwards(log.robot, FRICTION)
    (verdict,) = diagnosis.judge_by_simulation(0.5)
    assert verdict.worsens and diagnosis.vetoed == diagnosis.findings
    assert not any(term.kind == "spring" for term in diagnosis.model.effect_terms_)
    told = [note for note in diagnosis.warnings if "worsens the simulated motion" in note]
    assert len(told) == 1 and "joint1" in told[0]
    assert any(t.kind == "spring" for t in diagnosis.add("spring").effect_terms_)
    diagnosis.base_model = given
    (verdict,) = diagnosis.judge_by_simulation(0.5)
    assert verdict.improves and not verdict.worsens and diagnosis.vetoed == []
    assert any(term.kind == "spring" for term in diagnosis.model.effect_terms_)
    assert not [note for note in diagnosis.warnings if "worsens the simulated motion" in note]


@pytest.mark.slow
def test_findings_of_a_log_of_commands_are_judged_through_the_servo(log):
    servo = Controller(60.0, 4.0, follows_velocity=False)
    torque = np.asarray(log.y)
    commands = (
        log.frame[["q1", "q2"]].to_numpy()
        + (torque + 4.0 * log.frame[["dq1", "dq2"]].to_numpy()) / 60.0
    )
    X = log.X.assign(cmd1=commands[:, 0], cmd2=commands[:, 1])
    model = RBDRegressor(log.robot, FRICTION)
    diagnosis = diagnose(model, X, servo_torque(servo, X), checks=())
    assert [finding.kind for finding in diagnosis.findings] == ["spring"]
    (verdict,) = diagnosis.judge_by_simulation(controller=servo)
    assert verdict.improves and diagnosis.vetoed == []


def test_only_models_with_an_inertia_are_judged(log, diagnosis):
    given, diagnosis.base_model = diagnosis.base_model, object()
    with pytest.raises(SkidynError, match="inertia of an RBDRegressor"):
        diagnosis.judge_by_simulation(0.5)
    diagnosis.base_model = given
