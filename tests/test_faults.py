# SPDX-License-Identifier: BSD-3-Clause
"""What breaks around the program; each test is a row of docs/user_guide/faults.rst."""

import os
import signal
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from sklearn.neighbors import KNeighborsRegressor

from skidyn import save_model
from skidyn.datasets import load_planar_arm
from skidyn.export import write_urdf
from skidyn.identification import RBDRegressor
from skidyn.neural_network import LSTMRegressor
from skidyn.report import write_json
from skidyn.robots import Robot


def _chain(n):
    """A robot whose description is long."""
    text = "<robot name='r'><link name='l0'/>"
    for k in range(n):
        text += (
            f"<link name='l{k + 1}'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' "
            f"ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='j{k}' type='continuous'>"
            f"<parent link='l{k}'/><child link='l{k + 1}'/><axis xyz='0 0 1'/></joint>"
        )
    return Robot.from_urdf(text + "</robot>")


_FEW, _MANY = (KNeighborsRegressor().fit(np.eye(n)[:, :5], np.arange(n)) for n in (5, 5000))
#: Everything that writes a file, with something small to write and something large.
WRITERS = {
    "report.json": (write_json, {"a": 1}, {"a": list(range(60_000))}),
    "model.skops": (save_model, _FEW, _MANY),
    "robot.urdf": (lambda path, robot: write_urdf(robot, path), _chain(1), _chain(300)),
}


@contextmanager
def files_of_at_most(size):
    """What the system refuses beyond it, it refuses like a full disk: amid the writing."""
    resource = pytest.importorskip("resource")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)


@contextmanager
def nobody():
    """Root may write anywhere, so the tests of root are done by another user."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(0)


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_leaves_the_old_file(tmp_path, name):
    write, small, large = WRITERS[name]
    write(tmp_path / name, small)
    before = {f.name: f.read_bytes() for f in tmp_path.iterdir()}
    with files_of_at_most(50_000), pytest.raises(OSError, match="File too large"):
        write(tmp_path / name, large)
    assert {f.name: f.read_bytes() for f in tmp_path.iterdir()} == before


@pytest.mark.parametrize("name", WRITERS)
def test_a_read_only_folder_is_named(name):
    write, small, _ = WRITERS[name]
    with tempfile.TemporaryDirectory() as parent:  # others may enter it, unlike tmp_path
        os.chmod(parent, 0o755)
        folder = Path(parent, "read_only")
        folder.mkdir(mode=0o555)
        with nobody(), pytest.raises(PermissionError, match="read_only"):
            write(folder / name, small)
        assert not list(folder.iterdir())


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
