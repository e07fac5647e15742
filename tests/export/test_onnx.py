# SPDX-License-Identifier: BSD-3-Clause
"""The exported graph in ONNX Runtime."""

import json

import numpy as np
import pytest

from skidyn.export import to_onnx, write_onnx
from skidyn.robots import Robot

onnx = pytest.importorskip("onnx", reason="needs skidyn[export]")
runtime = pytest.importorskip("onnxruntime")


def run(content, motion):
    session = runtime.InferenceSession(content, providers=["CPUExecutionProvider"])
    return session.run(["tau"], dict(zip(("q", "dq", "ddq"), motion, strict=True)))[0]


@pytest.mark.parametrize("name", ["tree", "scara"])
def test_every_static_effect_equals_predict(models, name, tmp_path, states):
    model = models[name]
    motion = states(model.robot_)
    assert write_onnx(model, tmp_path / "model.onnx") == ()
    torque = run((tmp_path / "model.onnx").read_bytes(), motion)
    expected = model.predict(np.hstack(motion))
    np.testing.assert_allclose(torque, expected, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("name", ["ur5", "panda", "planar_arm"])
def test_consistent_models_equal_predict(consistent, name, states):
    model = consistent[name]
    content = to_onnx(model).SerializeToString()
    for n_samples in (1, 60):  # any number of samples
        motion = states(model.robot_, n_samples)
        expected = model.predict(np.hstack(motion))
        np.testing.assert_allclose(run(content, motion), expected, rtol=1e-10, atol=1e-10)


def test_torques_that_vanish_have_a_value_for_every_sample(states):
    robot = Robot.from_urdf(
        '<robot name="free"><link name="a"/><link name="b"/><joint name="j" type="continuous">'
        '<parent link="a"/><child link="b"/></joint></robot>'
    )
    np.testing.assert_array_equal(
        run(to_onnx(robot).SerializeToString(), states(robot)), np.zeros((60, 1))
    )


def test_the_metadata_says_what_the_columns_are_and_what_is_missing(models, fit):
    model = fit(models["scara"].robot_, ("viscous", ("dahl", [2])))
    facts = {p.key: json.loads(p.value) for p in to_onnx(model).metadata_props}
    assert facts["joints"] == list(model.robot_.joint_names)
    assert facts["not_held"] == ["dahl of joint2"]
