# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn export``."""

from __future__ import annotations

import json

import numpy as np

from skidyn import cli
from skidyn.robots import Robot


def test_every_format_is_written_and_what_it_lacks_is_said(work, run, tmp_path):
    files = {
        "--c": "model.c",
        "--python": "model.py",
        "--to-urdf": "new.urdf",
        "--to-mjcf": "new.xml",
    }
    words = [w for option, name in files.items() for w in (option, tmp_path / name)]
    model = ("--model", "rigid_body,viscous,coulomb,dahl", "--consistent")

    code, written = run("export", work / "log.csv", "--urdf", work / "arm.urdf", *model, *words)

    assert code == cli.DONE
    left = {path.rsplit("/", 1)[1]: names for path, names in written.items()}
    for name in files.values():
        assert any("dahl" in effect for effect in left[name]), left
    beside = json.loads((tmp_path / "model.c.skidyn.json").read_text())
    assert all("dahl" in name for name in beside)
    namespace = {}
    exec((tmp_path / "model.py").read_text(), namespace)
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, 5, 2))
    urdf = Robot.from_urdf(tmp_path / "new.urdf")
    friction = namespace["inverse_dynamics"](q, dq, ddq) - urdf.inverse_dynamics(q, dq, ddq)
    viscous = namespace["inverse_dynamics"](q, 0 * dq, ddq) - urdf.inverse_dynamics(q, 0 * dq, ddq)
    np.testing.assert_allclose(viscous, 0, atol=1e-9)
    assert np.all(friction * dq > 0)


def test_nothing_to_write_is_refused(work, capsys):
    words = ["export", str(work / "log.csv"), "--urdf", str(work / "arm.urdf")]

    assert cli.main(words) == cli.BAD_INPUT
    assert "nothing to write" in capsys.readouterr().err
