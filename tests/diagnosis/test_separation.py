# SPDX-License-Identifier: BSD-3-Clause
"""A motion that tells rivals apart: within the limits, and it does so when simulated."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import (
    SeparatingMotion,
    design_separating_motion,
    diagnose,
    findings_to_separate,
)
from skidyn.effects import Term
from skidyn.exceptions import EffectError
from skidyn.identification import RBDRegressor


def diagnosis_of(kind, *rivals):
    options = {"joints": [2], "noise": "high", "n_trajectories": 6, "duration": 6.0}
    log = make_hidden_effect_log(load_planar_arm(), kind, random_state=5, **options)
    return diagnose(RBDRegressor(log.robot), log.X, log.y, effects=[kind, *rivals], checks=())


@pytest.fixture(scope="module")
def diagnosis():
    return diagnosis_of("maxwell_slip", "dahl")


@pytest.fixture(scope="module")
def motion(diagnosis):
    return design_separating_motion(diagnosis, "maxwell_slip", "dahl")


@pytest.mark.slow
def test_hysteresis_is_told_apart_by_a_motion_that_the_log_lacked(diagnosis, motion):
    assert {"dahl", "maxwell_slip"} <= {diagnosis.findings[0].kind, *diagnosis.findings[0].rivals}
    assert motion.gain > 3 * motion.gain_of_log
    assert motion.confirmed == {"maxwell_slip": True, "dahl": True}
    assert "both effects were recognised" in motion.sentence


def test_what_is_still_not_recognised_is_named_with_what_to_do():
    still = np.zeros((3, 1))
    motion = SeparatingMotion(
        "dahl", "stribeck", (1,), np.array([0.0, 10.0, 20.0]), still, still, still, 90.0, 3.0,
        {"dahl": True, "stribeck": False},
    )  # fmt: skip
    assert "with stribeck as the truth, stribeck was still not recognised" in motion.sentence
    assert "--duration 40" in motion.sentence
    motion = replace(motion, confirmed={"dahl": False, "stribeck": False})
    assert "dahl or stribeck as the truth, neither of the two was recognised" in motion.sentence


@pytest.mark.slow
def test_the_motion_keeps_the_limits_and_starts_and_ends_at_rest(diagnosis, motion):
    robot, log = diagnosis.problem.robot, diagnosis.problem.signals
    low, high = robot.position_limits.T

    assert motion.joints == (2,)
    assert np.all((motion.q >= low) & (motion.q <= high))
    assert np.all(np.abs(motion.dq).max(0) <= robot.velocity_limits)
    assert np.all(np.abs(motion.dq).max(0) <= 1.001 * np.abs(log.dq).max(0))
    assert np.all(np.abs(motion.ddq).max(0) <= 1.001 * np.abs(log.ddq).max(0))
    assert np.ptp(motion.q[:, 0]) == 0
    for state in (motion.dq, motion.ddq):
        assert np.abs(state[0]).max() < 1e-9


@pytest.mark.slow
def test_velocity_and_acceleration_are_the_derivatives(motion):
    step = motion.time[1]
    inner = slice(2, -2)

    for x, dx in ((motion.q, motion.dq), (motion.dq, motion.ddq)):
        before, after = x[1:-3, 1] - x[3:-1, 1], x[:-4, 1] - x[4:, 1]
        numeric = (after - 8 * before) / (12 * step)  # fourth order
        assert np.abs(numeric - dx[inner, 1]).max() < 0.05 * np.abs(dx[:, 1]).max()


@pytest.mark.slow
def test_the_motion_as_a_table(motion):
    table = motion.to_frame()

    assert list(table.columns) == ["time", "q1", "q2", "dq1", "dq2", "ddq1", "ddq2"]
    np.testing.assert_array_equal(table["q2"], motion.q[:, 1])


@pytest.mark.slow
def test_a_rival_that_contains_the_effect_cannot_be_told_from_it():
    diagnosis = diagnosis_of("spring", "nonlinear_spring")

    motion = design_separating_motion(diagnosis, "spring", "nonlinear_spring", duration=5)

    assert motion.gain < 1
    assert motion.sentence.startswith("No motion of joint 2")


@pytest.mark.slow
def test_rivals_that_were_not_compared_are_refused_with_those_that_were(diagnosis):
    with pytest.raises(EffectError, match="not compared maxwell_slip with payload, only with"):
        design_separating_motion(diagnosis, "maxwell_slip", "payload")


def told(kind, *rivals):
    return SimpleNamespace(kind=kind, rivals=rivals)


def test_of_several_findings_of_one_kind_that_with_a_rival_is_chosen():
    findings = [told("unknown", "spring"), told("coulomb"), told("coulomb", "unknown", "stribeck")]

    assert findings_to_separate([*findings, told("coulomb")]) == findings[2:]
    assert findings_to_separate(findings, "coulomb", "stribeck")[0] is findings[2]


def test_findings_that_no_motion_separates_are_refused_with_those_that_one_does():
    unknown = told("unknown", "spring")
    with pytest.raises(EffectError, match="nothing to separate: no finding has a rival"):
        findings_to_separate([unknown, told("coulomb", "unknown")])
    findings = [unknown, told("dahl", "lugre"), told("dahl", "lugre", "maxwell_slip")]
    with pytest.raises(EffectError, match="no finding spring .* dahl from lugre or maxwell_slip$"):
        findings_to_separate(findings, "spring")


def test_the_rival_of_one_joint_of_an_effect_is_found(missing, monkeypatch):
    monkeypatch.setattr("skidyn.diagnosis._separation.ROUNDS", 1)
    monkeypatch.setattr("skidyn.diagnosis._separation.POPULATION", 1)
    (spring,), (found,) = missing.findings, missing.result.findings
    first = found.candidates[0]
    second = replace(first, term=replace(first.term, joints=(1,)))
    rival = Term("viscous", (2,))
    other = replace(found, kind="viscous", candidates=(replace(first, term=rival),))
    alone = replace(found, margin=-1.0, others=(other,))
    both = replace(found, candidates=(first, second), alone=(alone,), others=())
    diagnosis = replace(
        missing,
        findings=[
            replace(spring, rivals=("viscous",)),
            replace(spring, joints=(1,), terms=(second.term,)),
        ],
        result=replace(missing.result, findings=[both]),
    )

    motion = design_separating_motion(diagnosis, duration=3.0)

    assert (motion.kind, motion.rival, motion.joints) == ("spring", "viscous", (2,))
