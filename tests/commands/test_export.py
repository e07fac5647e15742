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
    assert "'matlab'; expected some of c, python, onnx, urdf, mjcf" in capsys.readouterr().err
