# SPDX-License-Identifier: BSD-3-Clause
"""What the motion of servos lacks is named from commands and positions."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.effects import Term
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor
from skidyn.simulation import Controller, explain_servo_motion, servo_torque, simulate

FRICTION = ("viscous", "coulomb")
SERVO = Controller((200.0, 12.0), (12.0, 0.6), follows_velocity=False)
#: Coefficients of every joint.
SIZES = {"viscous": (0.4, 0.03), "coulomb": (0.8, 0.06)}
STICTION = Term("stribeck", (2,), {"vs": 0.1, "delta": 2.0})
ENCODER = 2 * np.pi / 2**14


def servo_log(terms):
    """A planar arm behind servos with rounded positions, and its robot."""
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=4, duration=6.0)
    truth = RBDRegressor(log.robot, [*FRICTION, *terms], "nominal").fit(log.X, log.y)
    for term in truth.effect_terms_:
        size = terms[term] if term in terms else SIZES[term.kind][term.places[0]]
        truth.effect_coefficients_[term] = np.array([size])
    wanted = log.X.assign(q_ref1=log.X["q1"], q_ref2=log.X["q2"])
    moved = simulate(truth, wanted, controller=SERVO, step=2.5e-3)
    for j in (1, 2):
        moved[f"q{j}"] = np.round(moved[f"q{j}"] / ENCODER) * ENCODER
        for _, run in moved.groupby("trajectory"):
            moved.loc[run.index, f"dq{j}"] = np.gradient(run[f"q{j}"], run["time"])
    columns = ["time", "trajectory", "q1", "q2", "dq1", "dq2", "q_ref1", "q_ref2"]
    return log.robot, moved[columns]


@pytest.fixture(scope="module")
def sticky():
    return servo_log({STICTION: 0.15})


def test_stiction_is_named_on_its_joint_with_its_size(sticky):
    robot, log = sticky
    model = RBDRegressor(robot, FRICTION).fit(log, servo_torque(SERVO, log))
    (found,) = explain_servo_motion(model, log, SERVO)
    assert (found.kind, found.joint) == ("stribeck", 2)
    assert found.parameters["dF"] == pytest.approx(0.15, rel=0.4)
    assert found.parameters["vs"] == pytest.approx(0.1, rel=0.4)
    assert found.after < 0.6 * found.before
    assert "Stribeck friction of joint 2" in str(found)


def test_nothing_is_named_where_friction_is_all():
    robot, log = servo_log({})
    model = RBDRegressor(robot, FRICTION).fit(log, servo_torque(SERVO, log))
    assert explain_servo_motion(model, log, SERVO) == []


def test_a_diagnosis_asks_for_joints_without_a_name(sticky):
    robot, log = sticky
    diagnosis = diagnose(
        RBDRegressor(robot, FRICTION), log, servo_torque(SERVO, log), effects=["spring"]
    )
    assert [f.kind for f in diagnosis.explain_servo_motion(SERVO)] == ["stribeck"]


def test_a_joint_that_the_robot_lacks_and_a_short_log_are_refused(sticky):
    robot, log = sticky
    model = RBDRegressor(robot, FRICTION).fit(log, servo_torque(SERVO, log))
    with pytest.raises(SkidynError, match=r"joints=\[3\]; the robot has joints 1 to 2"):
        explain_servo_motion(model, log, SERVO, joints=[3])
    with pytest.raises(SkidynError, match="holds 1 piece"):
        explain_servo_motion(model, log[log["trajectory"] == 1], SERVO)
