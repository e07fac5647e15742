# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn export``."""

from __future__ import annotations

import json

import numpy as np
import pytest

from skidyn import cli
from skidyn.robots import Robot


def test_every_format_is_written_and_what_it_lacks_is_said(work, run, tmp_path):
    pytest.importorskip("onnx", reason="needs skidyn[export]")
    files = ["model.c", "model.py", "model.onnx", "model.urdf", "model.xml"]
    words = ("--format", "c,python,onnx,urdf,mjcf", "--out", tmp_path / "model")
    model = ("--model", "rigid_body,viscous,coulomb,dahl", "--consistent")

    code, written = run("export", work / "log.csv", "--urdf", work / "arm.urdf", *model, *words)

    assert code == cli.DONE
    left = {path.rsplit("/", 1)[1]: names for path, names in written.items()}
    assert sorted(left) == sorted(files)
    for name in files:
        assert any("dahl" in effect for effect in left[name]), left
    beside = json.loads((tmp_path / "model.c.skidyn.json").read_text())
    assert {effect["kind"] for effect in beside["not_held"]} == {"dahl"}
    namespace = {}
    exec((tmp_path / "model.py").read_text(), namespace)
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, 5, 2))
    urdf = Robot.from_urdf(tmp_path / "model.urdf")
    friction = namespace["inverse_dynamics"](q, dq, ddq) - urdf.inverse_dynamics(q, dq, ddq)
    viscous = namespace["inverse_dynamics"](q, 0 * dq, ddq) - urdf.inverse_dynamics(q, 0 * dq, ddq)
    np.testing.assert_allclose(viscous, 0, atol=1e-9)
    assert np.all(friction * dq > 0)


def test_one_format_gets_the_name_it_is_given(work, run, tmp_path):
    out = tmp_path / "feedforward.h"

    code, written = run(
        "export", work / "log.csv", "--urdf", work / "arm.urdf", "--format", "c", "--out", out
    )

    assert code == cli.DONE
    assert written == {str(out.resolve()): []}
    assert "void skidyn_inverse_dynamics" in out.read_text()


def test_an_unknown_format_is_refused_before_anything_is_read(tmp_path, capsys):
    words = ["export", "log.csv", "--urdf", "arm.urdf", "--format", "c,matlab", "--out", "m"]

    assert cli.main(words) == cli.BAD_INPUT
    assert (
        "'matlab'; expected some of c, python, onnx, urdf, mjcf, usd, bam, ros2"
        in capsys.readouterr().err
    )


def test_a_servo_and_a_ros_package_are_written(work, run, tmp_path):
    log = ("export", work / "log.csv", "--urdf", work / "arm.urdf", "--consistent")
    servo = ("--servo", "joint2", "--actuator", "mx64", "--motor", '{"kt": 1.6}')

    code, written = run(*log, "--format", "bam", *servo, "--out", tmp_path / "m1.json")

    assert code == cli.DONE and list(written) == [str(tmp_path / "m1.json")]
    bam = json.loads((tmp_path / "m1.json").read_text())
    assert (bam["model"], bam["actuator"], bam["kt"]) == ("m1", "mx64", 1.6)

    code, written = run(*log, "--format", "ros2", "--out", tmp_path / "arm_dynamics")

    assert code == cli.DONE
    assert (tmp_path / "arm_dynamics" / "arm_dynamics.xml").exists()
    code, _ = run(*log, "--format", "ros2", "--out", tmp_path / "arm_dynamics")
    assert code == cli.BAD_INPUT, "a command replaces no folder"


def test_a_usd_layer_needs_a_stage(work, capsys):
    words = ["export", str(work / "log.csv"), "--urdf", str(work / "arm.urdf"), "--format", "usd"]

    assert cli.main([*words, "--out", "new.usda"]) == cli.BAD_INPUT
    assert "--into is missing" in capsys.readouterr().err


def test_formats_that_can_be_written_are_and_the_others_are_named(work, tmp_path, capsys):
    (tmp_path / "model.py").mkdir()  # cannot be written
    (tmp_path / "model.py").rmdir()
    words = ["export", str(work / "log.csv"), "--urdf", str(work / "arm.urdf")]
    out = ["--format", "c,urdf,python", "--out", str(tmp_path / "model"), "--json"]
    from skidyn import export

    def broken(model, path):
        raise OSError(28, "No space left on device", str(path))

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(export, "write_urdf", broken)
        assert cli.main([*words, *out]) == cli.BAD_INPUT
    caught = capsys.readouterr()
    assert sorted(name.rpartition("/")[2] for name in json.loads(caught.out)) == [
        "model.c",
        "model.py",
    ]
    assert "not written: urdf: " in caught.err and "No space left" in caught.err
    assert sorted(f.name for f in tmp_path.iterdir() if "skidyn" not in f.name) == [
        "model.c",
        "model.py",
    ]


def test_a_model_of_servos_is_exported_without_torque(servo_diagnosed, run, tmp_path):
    words = ["export", *servo_diagnosed[1:6], "--consistent", "--format", "urdf"]
    code, left = run(*words, "--out", tmp_path / "new.urdf")
    assert code == cli.DONE and list(left.values()) == [[]]
    assert 'friction="0.' in (tmp_path / "new.urdf").read_text("utf-8")
