# SPDX-License-Identifier: BSD-3-Clause
"""What the motion of servos names stands in the story of a diagnosis."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor
from skidyn.measurement import list_checks
from skidyn.simulation import Controller, ServoFinding, servo_torque

STICTION = ServoFinding("stribeck", 2, {"dF": 0.15}, 0.004, 0.001, "dahl", 0.003)


@pytest.fixture(scope="module")
def diagnosis():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=4.0)
    return diagnose(
        RBDRegressor(log.robot, ("viscous", "coulomb")), log.X, log.y, effects=(), checks=()
    )


def test_the_headline_says_what_the_motion_names(diagnosis, monkeypatch):
    assert diagnosis.story()["servo_motion"] is None
    before = diagnosis.story()["headline"]
    monkeypatch.setattr(diagnosis, "servo_motion", [STICTION])
    story = diagnosis.story()
    assert story["headline"] == (
        f"{before} in the torque; the motion of the servos shows Stribeck friction on joint 2"
    )
    assert story["mark"] == "!"
    (line,) = story["servo_motion"]["findings"]
    assert (line["what"], line["where"], line["size"]) == (
        "Stribeck friction", "joint 2", "dF = 0.15 N m"
    )  # fmt: skip
    assert [row["error"] for row in line["errors"]] == pytest.approx([4.0, 1.0, 3.0])
    assert story["servo_motion"]["text"] == "The torque does not show it."
    assert STICTION.sentence in repr(diagnosis)
    assert line["evidence"] in diagnosis._repr_html_()


def test_a_motion_that_names_nothing_changes_no_verdict(diagnosis, monkeypatch):
    before = diagnosis.story()
    monkeypatch.setattr(diagnosis, "servo_motion", [])
    story = diagnosis.story()
    assert (story["headline"], story["mark"]) == (before["headline"], before["mark"])
    assert story["servo_motion"]["findings"] == []


def test_a_joint_whose_rotor_was_forgotten_may_still_get_a_name(monkeypatch):
    log = make_hidden_effect_log(
        load_planar_arm(), "rotor_inertia", joints=[2], n_trajectories=3, duration=4.0
    )
    model = RBDRegressor(log.robot, ("viscous", "coulomb"))
    found = diagnose(model, log.X, log.y, effects=["rotor_inertia"], checks=())
    assert [(f.kind, f.joints) for f in found.findings] == [("rotor_inertia", (2,))]
    asked = []

    def explain(model, X, controller, *, joints, known):
        asked.append((joints, model.effect_terms_[-1].kind))
        return []

    monkeypatch.setattr("skidyn.diagnosis._result.explain_servo_motion", explain)
    assert found.explain_servo_motion(Controller(40.0)) == []
    assert asked == [([1, 2], "rotor_inertia")]
    assert found.verdict == "missing"


def test_a_limit_that_the_controller_has_is_no_name(monkeypatch):
    log = make_hidden_effect_log(
        load_planar_arm(), "saturation", joints=[2], n_trajectories=3, duration=4.0
    )
    model = RBDRegressor(log.robot, ("viscous", "coulomb"))
    found = diagnose(model, log.X, log.y, effects=["saturation"], force=True)
    assert [(f.kind, f.joints) for f in found.findings] == [("saturation", (2,))]
    asked = []

    def explain(model, X, controller, *, joints, known):
        asked.append(joints)
        return []

    monkeypatch.setattr("skidyn.diagnosis._result.explain_servo_motion", explain)
    for limit in (np.inf, 5.0):
        found.explain_servo_motion(Controller(40.0, limit=limit))
    assert asked == [[1], [1, 2]]


@pytest.mark.slow
def test_a_torque_of_servos_has_no_sensor_that_could_be_wrong(sticky_servo):
    log, servo = sticky_servo.log, sticky_servo.controller
    limited = replace(servo, limit=100.0)
    model = RBDRegressor(sticky_servo.robot, ("viscous", "coulomb"))
    found = diagnose(model, log, controller=limited, effects=["saturation"])
    assert found.findings == [] and found.controller is limited
    assert {f.kind for f in found.explain_servo_motion()} == {"stribeck"}
    sensors = {check.name for check in list_checks() if check.of_sensor}
    assert not sensors & {check.check for check in found.checks}
    with pytest.raises(ValueError, match="tau is None; pass the measured torque, or controller"):
        diagnose(model, log)
    with pytest.raises(SkidynError, match="controller is missing"):
        diagnose(model, log, servo_torque(servo, log), effects=()).explain_servo_motion()
