# SPDX-License-Identifier: BSD-3-Clause
"""What dominates a joint does not hide itself: in few short recordings it is named as well."""

import numpy as np
import pytest

from skidyn.datasets import load_panda, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor

PANDA_MODEL = ("viscous", "coulomb", "rotor_inertia")


@pytest.fixture(scope="module")
def panda_log():
    return make_hidden_effect_log(
        load_panda(), None, noise="low", n_trajectories=6, duration=2.5, random_state=0
    )


def findings_of(log, torque):
    """The log is as it should be: no test looks at its checks."""
    return diagnose(RBDRegressor(log.robot, PANDA_MODEL), log.X, torque, checks=()).findings


@pytest.mark.slow
def test_friction_that_another_joint_modulates(panda_log):
    q, dq = panda_log.X[["q3", "dq5"]].to_numpy().T
    torque = np.array(panda_log.y)
    torque[:, 4] += 8 * np.std(torque[:, 4]) * np.sin(q) * np.sign(dq)

    found = findings_of(panda_log, torque)

    assert [(f.kind, f.joints, set(f.variables)) for f in found] == [
        ("unknown", (5,), {"q3", "dq5"})
    ]


@pytest.mark.slow
def test_a_torque_that_sets_in_is_told_with_its_moment(panda_log):
    since = panda_log.X["time"] - panda_log.X.groupby("trajectory")["time"].transform("min")
    late = (panda_log.X["trajectory"] > 4) | ((panda_log.X["trajectory"] == 4) & (since > 1.5))
    torque = np.array(panda_log.y)
    torque[late, 1] += 2 * np.std(torque[:, 1])

    found = findings_of(panda_log, torque)

    assert [(f.kind, f.joints, f.variables) for f in found] == [("unknown", (2,), ("time",))]
    moment = panda_log.X["time"][late].min()
    told = float(found[0].title.split(" at ")[1].removesuffix(" s"))
    assert told == pytest.approx(moment, abs=0.2)


def test_a_stop_that_one_recording_touches(panda_log):
    q = panda_log.X["q2"].to_numpy()
    stop = float(panda_log.X.groupby("trajectory")["q2"].max().sort_values().iloc[-2])
    torque = np.array(panda_log.y)
    pressed = np.maximum(0.0, q - stop)
    torque[:, 1] += 2 * np.std(torque[:, 1]) * pressed / pressed.max()

    found = findings_of(panda_log, torque)

    assert [(f.kind, f.joints) for f in found] == [("end_stop", (2,))]
    assert found[0].parameters["q_lim"]["value"] == pytest.approx(stop, abs=0.05)
    assert found[0].error_drop > 0.5


@pytest.mark.slow
def test_a_plane_that_one_recording_touches(panda_log):
    robot = panda_log.robot
    q = panda_log.X[[f"q{j + 1}" for j in range(7)]].to_numpy()
    normal = np.array([0.35, -0.3, 0.89]) / np.linalg.norm([0.35, -0.3, 0.89])
    height = robot.forward_kinematics(q)[0] @ normal
    lowest = np.sort(
        [height[rows].min() for rows in panda_log.X.groupby("trajectory").indices.values()]
    )
    depth = np.maximum(0.0, lowest[1] - height)
    force = np.where(depth > 0, (depth / depth.max()) ** 1.5, 0.0)
    push = np.einsum("iaj,a->ij", robot.jacobian(q)[:, :3], normal)
    torque = panda_log.y - 40.0 * force[:, None] * push

    found = findings_of(panda_log, torque)

    assert [f.kind for f in found] == ["environment_contact"]
