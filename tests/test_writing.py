# SPDX-License-Identifier: BSD-3-Clause
"""What is written replaces files only, and never what it was made from."""

import json
import os
import signal
import stat
import subprocess
import sys
import tempfile
import threading
from contextlib import contextmanager
from pathlib import Path

import pytest

from skidyn import save_model
from skidyn.datasets import load_planar_arm
from skidyn.exceptions import SkidynError
from skidyn.export import write_urdf
from skidyn.report import write_json
from skidyn.robots import Robot

WRITERS = {
    "report.json": lambda path: write_json(path, {"a": 1}),
    "robot.urdf": lambda path: write_urdf(load_planar_arm(), path),
    "model.skops": lambda path: save_model(path, {"a": 1}),
}
posix = pytest.mark.skipif(os.name != "posix", reason="there are no such files elsewhere")


@pytest.fixture(params=WRITERS)
def writer(request):
    if request.param == "model.skops":
        pytest.importorskip("skops.io")
    return request.param, WRITERS[request.param]


@pytest.fixture
def large(writer, chain):
    """Writes the same kind of file with more in it than small disks hold."""
    robot = Robot.from_urdf(chain([f"j{k}" for k in range(300)]))
    return {
        "report.json": lambda path: write_json(path, {"a": list(range(60_000))}),
        "robot.urdf": lambda path: write_urdf(robot, path),
        "model.skops": lambda path: save_model(path, {"a": list(range(60_000))}),
    }[writer[0]]


@posix
def test_every_output_has_the_mode_of_a_new_file(tmp_path, writer):
    name, write = writer
    before = os.umask(0o027)
    try:
        write(tmp_path / name)
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / name).stat().st_mode) == 0o640


@posix
def test_the_umask_of_the_process_is_never_touched(tmp_path, writer, monkeypatch):
    name, write = writer
    monkeypatch.setattr(os, "umask", lambda *_: pytest.fail("other threads would see it"))
    write(tmp_path / name)


@posix
def test_a_link_stays_a_link_and_its_target_is_replaced(tmp_path, writer):
    name, write = writer
    (tmp_path / "elsewhere").mkdir()
    target = tmp_path / "elsewhere" / "target"
    target.write_text("old")
    (tmp_path / name).symlink_to(target)
    write(tmp_path / name)
    assert (tmp_path / name).is_symlink()
    assert target.read_bytes() == (tmp_path / name).read_bytes() != b"old"
    assert [f.name for f in target.parent.iterdir()] == ["target"]


@posix
@pytest.mark.parametrize("kind", ["pipe", "folder", "device"])
def test_what_is_no_file_is_never_replaced(tmp_path, writer, kind):
    name, write = writer
    path = tmp_path / name
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    else:
        path.symlink_to("/dev/null")  # the link would be followed to the device
    before = os.stat(path)
    with pytest.raises(SkidynError, match=f"{name} is not a regular file"):
        write(path)
    after = os.stat(path)
    assert (after.st_ino, after.st_mode) == (before.st_ino, before.st_mode)


@posix
def test_a_circle_of_links_is_named(tmp_path):
    (tmp_path / "a").symlink_to(tmp_path / "b")
    (tmp_path / "b").symlink_to(tmp_path / "a")
    with pytest.raises(OSError, match="/a'"):
        write_json(tmp_path / "a", {})


def test_a_description_and_what_it_lacks_are_written_together(tmp_path):
    (tmp_path / "robot.urdf.skidyn.json").mkdir()
    with pytest.raises(SkidynError, match="not a regular file"):
        write_urdf(load_planar_arm(), tmp_path / "robot.urdf")
    assert [f.name for f in tmp_path.iterdir()] == ["robot.urdf.skidyn.json"]


def test_many_writers_of_one_file_leave_a_whole_one(tmp_path):
    texts = [{"a": f"{k}" * 100_000} for k in range(8)]
    threads = [threading.Thread(target=write_json, args=(tmp_path / "a", t)) for t in texts]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert json.loads((tmp_path / "a").read_text()) in texts
    assert [f.name for f in tmp_path.iterdir()] == ["a"]


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


def test_a_full_disk_leaves_the_old_file(tmp_path, writer, large):
    name, write = writer
    write(tmp_path / name)
    before = {f.name: f.read_bytes() for f in tmp_path.iterdir()}
    with files_of_at_most(50_000), pytest.raises(OSError, match="File too large") as raised:
        large(tmp_path / name)
    assert raised.value.filename == str(tmp_path / name)
    assert {f.name: f.read_bytes() for f in tmp_path.iterdir()} == before


def test_a_read_only_folder_is_named(writer):
    name, write = writer
    with tempfile.TemporaryDirectory() as parent:  # others may enter it, unlike tmp_path
        os.chmod(parent, 0o755)
        folder = Path(parent, "read_only")
        folder.mkdir(mode=0o555)
        with nobody(), pytest.raises(PermissionError, match="read_only"):
            write(folder / name)
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
