# SPDX-License-Identifier: BSD-3-Clause
"""An exported MJCF, loaded by MuJoCo, is the fitted model."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_scara
from skidyn.effects import get_effect
from skidyn.export import write_mjcf

mujoco = pytest.importorskip("mujoco")


def inverse(path, motion, robot):
    """Torques by mj_inverse; what a joint that follows needs, its leader supplies."""
    model = mujoco.MjModel.from_xml_path(str(path))
    # a limit that is touched and a tie would add their own forces
    for flag in ("mjDSBL_LIMIT", "mjDSBL_EQUALITY"):
        model.opt.disableflags |= getattr(mujoco.mjtDisableBit, flag)
    data, tree = mujoco.MjData(model), robot.tree
    joints = [model.joint(name).dofadr[0] for name in robot.body_joints]
    torque = np.zeros_like(motion[0])
    for k in range(len(torque)):
        for signal, own in zip((data.qpos, data.qvel, data.qacc), motion, strict=True):
            signal[joints] = own[k, tree.coordinates] * tree.multipliers
        data.qpos[joints] += tree.offsets
        mujoco.mj_inverse(model, data)
        np.add.at(torque[k], tree.coordinates, tree.multipliers * data.qfrc_inverse[joints])
    return torque


@pytest.mark.parametrize("name", ["tree", "scara", "planar_arm", "ur5", "panda"])
def test_mujoco_gives_the_torque_of_the_model(consistent, name, states, tmp_path):
    model = consistent[name]
    assert write_mjcf(model, tmp_path / "robot.xml") == ()
    motion = states(model.robot_)
    sliding = np.abs(motion[1]).min(axis=1) > 0.02  # at rest MuJoCo lets dry friction hold
    motion = [signal[sliding] for signal in motion]
    expected = model.predict(np.hstack(motion))
    torque = inverse(tmp_path / "robot.xml", motion, model.robot_)
    np.testing.assert_allclose(torque, expected, atol=1e-6 * np.abs(expected).max())


def test_springs_have_a_field_and_negative_friction_has_none(fit, states, tmp_path):
    model = fit(load_scara(), ["spring", "viscous"], consistent=True)
    slack = next(t for t in model.effect_terms_ if t.kind == "viscous" and t.joints == (3,))
    model.effect_coefficients_[slack] = np.array([-0.1])
    assert write_mjcf(model, tmp_path / "robot.xml") == ("viscous of joint3",)
    q, dq, ddq = states(model.robot_)
    torque = inverse(tmp_path / "robot.xml", (q, dq, ddq), model.robot_)
    expected = model.predict(np.hstack([q, dq, ddq]))
    expected[:, 2] += 0.1 * dq[:, 2]
    np.testing.assert_allclose(torque, expected, atol=1e-8)
    assert get_effect("spring").coefficients[0].name == "k"


def test_joints_that_follow_are_tied_and_fixed_links_are_sites(load, tmp_path):
    write_mjcf(load("tree"), tmp_path / "tree.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "tree.xml"))
    assert model.neq == 1 and model.nv == 3 and model.nsite == 2


def test_impossible_bodies_are_refused_by_name(tmp_path):
    robot = load_scara()
    parameters = robot.inertial_parameters.copy()
    parameters[2, 4] = -1.0
    with pytest.raises(ValueError, match="'quill' has the principal moments"):
        write_mjcf(replace(robot, inertial_parameters=parameters), tmp_path / "x")
