# SPDX-License-Identifier: BSD-3-Clause
"""Files of a command: what is read is never written; options of other types are refused."""

from __future__ import annotations

import os
import shutil

import pytest

from skidyn import cli


@pytest.mark.parametrize(
    "words",
    [
        ["diagnose", "{log}", "--urdf", "{urdf}", "--out", "{log}"],
        ["diagnose", "{log}", "--urdf", "{urdf}", "--out", "{other}"],  # a glob of the shell
        ["diagnose", "{log}", "--urdf", "{urdf}", "--html", "{urdf}"],
        ["diagnose", "{log}", "--urdf", "{urdf}", "--out", "{hard_link}"],
        ["diagnose", "{log}", "--urdf", "{urdf}", "--out", "{roundabout}"],
        ["identify", "{log}", "--urdf", "{urdf}", "--out", "{log}"],
        ["export", "{log}", "--urdf", "{urdf}", "--format", "urdf", "--out", "{urdf}"],
        ["export", "{log}", "--urdf", "{urdf}", "--format", "urdf", "--out", "{link}"],
        ["excite", "--urdf", "{urdf}", "--recorded", "{log}", "--out", "{log}"],
        ["payload", "{log}", "--unloaded", "{other}", "--urdf", "{urdf}", "--out", "{other}"],
        ["add", "--from", "{report}", "--effect", "dahl", "--out", "{report}"],
        ["separate", "--from", "{report}", "--out", "{log}"],
        ["excite", "--urdf", "{urdf}", "--recorded", "{folder}", "--out", "{log}"],
        ["excite", "--urdf", "{urdf}", "--recorded", "{pattern}", "--out", "{log}"],
        ["compare", "{report}", "{again}", "--html", "{page}"],  # numbers go beside the page
    ],
)
def test_no_command_writes_onto_what_it_reads(report, tmp_path, words, capsys):
    for name in ("log.csv", "arm.urdf", "report.json"):
        shutil.copy(report.parent / name, tmp_path / name)
    shutil.copy(tmp_path / "log.csv", tmp_path / "other.csv")
    shutil.copy(tmp_path / "report.json", tmp_path / "again.json")
    (tmp_path / "link.urdf").symlink_to(tmp_path / "arm.urdf")
    os.link(tmp_path / "log.csv", tmp_path / "hard.csv")
    places = {
        "hard_link": tmp_path / "hard.csv",
        "roundabout": tmp_path / "x" / ".." / "log.csv",
        "log": tmp_path / "log.csv",
        "other": tmp_path / "other.csv",
        "urdf": tmp_path / "arm.urdf",
        "link": tmp_path / "link.urdf",
        "report": tmp_path / "report.json",
        "again": tmp_path / "again.json",
        "page": tmp_path / "report.html",
        "folder": tmp_path,
        "pattern": tmp_path / "*.csv",
    }
    before = {f.name: f.read_bytes() for f in tmp_path.iterdir()}
    try:
        code = cli.main([word.format(**places) for word in words])
    except SystemExit as stopped:
        code = stopped.code
    assert code == cli.BAD_INPUT
    assert {f.name: f.read_bytes() for f in tmp_path.iterdir()} == before
    error = capsys.readouterr().err
    assert "read by this command" in error or "must end in" in error


@pytest.mark.parametrize(
    "option",
    [
        ["--columns", "[1]"],
        ["--columns", '{"q": {"a": 1}}'],
        ["--columns", '{"q": true}'],
        ["--columns", "q=1-99999999999"],
        ["--units", '["deg"]'],
        ["--units", '{"q": 3}'],
        ["--drive-gains", '{"a": 1}'],
        ["--drive-gains", '"x"'],
    ],
)
def test_options_of_other_types_are_one_line(work, option, capsys):
    words = ["compare", str(work / "log.csv"), "--urdf", str(work / "arm.urdf"), *option]
    assert cli.main(words) == cli.BAD_INPUT
    error = capsys.readouterr().err
    assert "expected" in error or "more than" in error or "--drive-gains" in option
    assert "Traceback" not in error


@pytest.mark.parametrize("jobs", ["0", "-3", "many"])
def test_numbers_of_processes_that_are_none_are_refused(work, jobs, capsys):
    words = ["diagnose", str(work / "log.csv"), "--urdf", str(work / "arm.urdf")]
    with pytest.raises(SystemExit) as stop:
        cli.main([*words, f"--jobs={jobs}"])
    assert stop.value.code == cli.BAD_INPUT
    assert "expected 1 or more, or -1" in capsys.readouterr().err
