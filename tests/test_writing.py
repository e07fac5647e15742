# SPDX-License-Identifier: BSD-3-Clause
"""What is written replaces files only, and never what it was made from."""

import os
import stat
import threading

import pytest

from skidyn import save_model
from skidyn._writing import keep, keeping_inputs, replacing, write_text
from skidyn.datasets import load_planar_arm
from skidyn.exceptions import SkidynError
from skidyn.export import write_urdf
from skidyn.report import write_json

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
        write_text(tmp_path / "a", "text")


def test_an_input_is_protected_under_every_name(tmp_path):
    log = write_text(tmp_path / "log.csv", "the recording")
    os.link(log, tmp_path / "hard.csv")
    names = [log, tmp_path / "hard.csv", tmp_path / "x" / ".." / "log.csv"]
    (tmp_path / "x").mkdir()
    with keeping_inputs():
        keep([log])
        for name in names:
            with pytest.raises(SkidynError, match="read by this command"):
                write_text(name, "a report")
    assert log.read_text() == "the recording"
    write_text(log, "no command is running")


def test_a_description_and_what_it_lacks_are_written_together(tmp_path):
    (tmp_path / "robot.urdf.skidyn.json").mkdir()
    with pytest.raises(SkidynError, match="not a regular file"):
        write_urdf(load_planar_arm(), tmp_path / "robot.urdf")
    assert [f.name for f in tmp_path.iterdir()] == ["robot.urdf.skidyn.json"]


def test_a_full_disk_names_the_file(tmp_path):
    with pytest.raises(OSError, match="No space left") as raised, replacing(tmp_path / "a.json"):
        raise OSError(28, "No space left on device")
    assert raised.value.filename == str(tmp_path / "a.json")
    assert list(tmp_path.iterdir()) == []


def test_many_writers_of_one_file_leave_a_whole_one(tmp_path):
    texts = [f"{k}" * 100_000 for k in range(8)]
    threads = [threading.Thread(target=write_text, args=(tmp_path / "a", t)) for t in texts]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (tmp_path / "a").read_text() in texts
    assert [f.name for f in tmp_path.iterdir()] == ["a"]
