# SPDX-License-Identifier: BSD-3-Clause
"""Servos that are not as stated are findings by the torque that their motion requires."""

import numpy as np
import pytest

from skidyn.diagnosis import diagnose
from skidyn.effects import get_effect, list_effects
from skidyn.exceptions import EffectError
from skidyn.identification import RBDRegressor
from skidyn.simulation import Controller, servo_torque

FRICTION = ("viscous", "coulomb", "rotor_inertia")
SETTINGS = [kind for kind in list_effects() if get_effect(kind).of_servo]


def diagnosed(servo, controller=None, effects=("stribeck", *SETTINGS), **words):
    return diagnose(
        RBDRegressor(servo.robot, FRICTION),
        servo.log,
        controller=controller or servo.controller,
        effects=effects,
        **words,
    )


@pytest.fixture(scope="module")
def weak(servo_log):
    """Servos whose second one supplies 0.5 N m at most, which nobody was told."""
    return servo_log({}, limit=(100.0, 0.5))


@pytest.fixture(scope="module")
def found(weak):
    return diagnosed(weak)


def covers(row, truth):
    return row["low"] <= truth <= row["high"]


def test_a_servo_as_stated_has_no_finding(servo_log, sticky_servo):
    for servo in (servo_log({}), sticky_servo):
        assert not {f.kind for f in diagnosed(servo).findings} & set(SETTINGS)


def test_a_limit_of_the_current_is_named_with_its_size(found):
    (finding,) = found.findings
    assert (finding.kind, finding.joints) == ("servo_current", (2,))
    limit = finding.parameters["limit"]
    assert limit["value"] == pytest.approx(0.5, rel=0.03) and covers(limit, 0.5)
    assert limit["unit"] == "N m" and finding.error_drop > 0.9
    assert found.verdict == "missing" and found.checks == []
    assert str(found).count("Current limit of the servo on joint 2: limit = 0.4") == 1


@pytest.mark.slow
def test_the_rest_is_judged_by_the_servo_with_its_limit(weak, found):
    assert found.controller.limit.tolist() == [
        np.inf,
        found.findings[0].parameters["limit"]["value"],
    ]
    assert found.rmse_before[1] < 0.1 * diagnosed(weak, effects=()).rmse_before[1]
    assert diagnosed(weak, found.controller).findings == []
    assert found.explain_servo_motion() == []


def test_a_finding_is_added_to_the_controller(weak, found):
    model = found.add("servo_current")
    torque = servo_torque(found.controller, weak.log)
    plain = RBDRegressor(weak.robot, FRICTION).fit(weak.log, torque)
    assert model.predict(weak.log) == pytest.approx(plain.predict(weak.log))
    with pytest.raises(EffectError, match="servo_gain was not found on these joints"):
        found.add("servo_gain", [2])


@pytest.mark.slow
def test_a_correct_setting_improves_the_simulated_motion(found):
    limited = found.controller
    (verdict,) = found.judge_by_simulation(controller=found.controller)
    assert verdict.improves and found.vetoed == []
    assert found.controller.limit.tolist() == limited.limit.tolist()
    assert found.to_dict()["effects"][0]["simulation"]["says"] == "improves"
    assert "falls" in found.story()["simulation"]["text"]


@pytest.mark.slow
def test_a_setting_that_worsens_the_motion_is_told_and_not_added(servo_log, found):
    fair = servo_log({})
    wrong = diagnosed(fair)
    wrong.findings = [finding] = found.findings  # a limit that these servos do not have
    (verdict,) = wrong.judge_by_simulation(controller=fair.controller)
    assert verdict.worsens and wrong.vetoed == [finding]
    assert np.isinf(wrong.controller.checked(2).limit).all()
    assert len([w for w in wrong.warnings if "worsens the simulated motion" in w]) == 1
    torque = servo_torque(fair.controller, fair.log)
    plain = RBDRegressor(fair.robot, FRICTION).fit(fair.log, torque)
    assert wrong.model.predict(fair.log) == pytest.approx(plain.predict(fair.log))
    assert "worsens the motion" in wrong.story()["simulation"]["text"]


def test_a_voltage_is_told_from_a_current(servo_log):
    slow = servo_log({}, limit=(100.0, 0.8), no_load_speed=(np.inf, 2.0))
    (finding,) = diagnosed(slow).findings
    assert (finding.kind, finding.joints) == ("servo_voltage", (2,))
    for name, truth in (("limit", 0.8), ("no_load_speed", 2.0)):
        row = finding.parameters[name]
        assert row["value"] == pytest.approx(truth, rel=0.1) and covers(row, truth)


@pytest.mark.slow
def test_a_gain_is_named_where_the_other_joint_is_as_stated(servo_log):
    (finding,) = diagnosed(servo_log({}, stiffness=(200.0, 8.0))).findings
    assert (finding.kind, finding.joints) == ("servo_gain", (2,))
    gain = finding.parameters["stiffness"]
    assert gain["value"] == pytest.approx(8.0, rel=0.01) and covers(gain, 8.0)
    assert gain["unit"] == "N m/rad" and finding.q_value < 1e-6
    both = servo_log({}, stiffness=(130.0, 8.0))  # the bodies of the description may be wrong
    assert diagnosed(both).findings == []


def test_settings_are_tried_only_if_they_are_asked_for(weak):
    assert {f.kind for f in diagnosed(weak, effects=["stribeck"]).findings} <= {"unknown"}


def test_a_torque_that_was_measured_has_no_servo(weak):
    torque = servo_torque(weak.controller, weak.log)
    model = RBDRegressor(weak.robot, FRICTION)
    found = diagnose(model, weak.log, torque, effects=["stribeck", *SETTINGS])
    assert not {f.kind for f in found.findings} & set(SETTINGS)
    with pytest.raises(EffectError, match="servo_gain is a setting of position servos"):
        diagnose(model, weak.log, torque, effects=SETTINGS)


@pytest.mark.slow
def test_a_doubtful_log_has_no_findings_about_its_servos(servo_log):
    late = servo_log({}, limit=(100.0, 0.5), delay=0.05)
    found = diagnosed(late)
    assert any("later than the controller states" in c.suspicion for c in found.checks)
    assert not {f.kind for f in found.findings} & set(SETTINGS)


@pytest.mark.slow
def test_a_deadband_that_nobody_was_told_is_named_and_added_to_the_controller(servo_log):
    loose = servo_log({}, deadband=(0.0, 0.01))
    found = diagnosed(loose, effects=["stribeck"])
    (motion,) = found.explain_servo_motion()
    assert motion.parameters == {"deadband": pytest.approx(0.01, rel=0.05)}
    assert motion.sentence.startswith("Deadband of the servo of joint 2 (deadband = 0.010")
    entry = found.to_dict()["effects"][-1]
    assert (entry["kind"], entry["joints"], entry["judged_by"]) == ("servo_deadband", [2], "motion")
    assert covers(entry["parameters"]["deadband"], 0.01)
    stated = Controller((200.0, 12.0), (12.0, 0.6), deadband=(0, motion.parameters["deadband"]),
                        follows_velocity=False)  # fmt: skip
    plain = RBDRegressor(loose.robot, FRICTION).fit(loose.log, servo_torque(stated, loose.log))
    assert found.add("servo_deadband").predict(loose.log) == pytest.approx(plain.predict(loose.log))
