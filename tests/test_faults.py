# SPDX-License-Identifier: BSD-3-Clause
"""What breaks around the program; each test is a row of docs/user_guide/faults.rst."""

import os
import subprocess
import sys

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.neural_network import LSTMRegressor
from skidyn.report import write_json
from skidyn.rigid_body import RBDRegressor


def test_a_full_disk_leaves_the_old_report(tmp_path, monkeypatch):
    file = write_json(tmp_path / "report.json", {"a": 1})
    before = file.read_text()
    monkeypatch.setattr(os, "replace", _no_space)
    with pytest.raises(OSError, match="No space left"):
        write_json(file, {"a": 2})
    assert file.read_text() == before
    assert [f.name for f in tmp_path.iterdir()] == ["report.json"]


def _no_space(*_):
    raise OSError(28, "No space left on device")


def test_a_process_killed_while_writing_leaves_the_old_report(tmp_path):
    file = write_json(tmp_path / "report.json", {"a": 1})
    before = file.read_text()
    code = (
        "import os, signal, sys\n"
        "from skidyn.report import write_json\n"
        "os.replace = lambda *_: os.kill(os.getpid(), signal.SIGKILL)\n"
        "write_json(sys.argv[1], {'a': list(range(100000))})"
    )
    done = subprocess.run([sys.executable, "-c", code, str(file)], capture_output=True)
    assert done.returncode == -9
    assert file.read_text() == before


@pytest.mark.skipif(hasattr(os, "geteuid") and os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder_is_named(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(PermissionError, match=tmp_path.name):
        write_json(tmp_path / "report.json", {})


def test_a_diverging_network_is_told():
    rng = np.random.default_rng(0)
    X, y = rng.normal(size=(200, 6)), rng.normal(size=(200, 2))
    model = LSTMRegressor(window=3, hidden_size=4, max_epochs=3, learning_rate=1e30)
    with pytest.raises(ValueError, match="training diverged in epoch 1"):
        model.fit(X, y)


def test_a_trajectory_of_a_million_rows_is_fitted_exactly():
    robot = load_planar_arm()
    t = np.arange(1_000_000) / 1000.0
    q = np.column_stack([np.sin(0.7 * t) + 0.3 * np.sin(2.1 * t), np.sin(1.3 * t + 1)])
    dq = np.column_stack(
        [0.7 * np.cos(0.7 * t) + 0.63 * np.cos(2.1 * t), 1.3 * np.cos(1.3 * t + 1)]
    )
    ddq = np.column_stack(
        [-0.49 * np.sin(0.7 * t) - 1.323 * np.sin(2.1 * t), -1.69 * np.sin(1.3 * t + 1)]
    )
    y = robot.inverse_dynamics(q, dq, ddq) + 2.0 * dq
    X = np.column_stack([t, q, dq, ddq])
    model = RBDRegressor(robot, ("viscous",), smooth=False, time=0).fit(X, y)
    np.testing.assert_allclose(model.coef_[-2:], 2.0, rtol=1e-8)
