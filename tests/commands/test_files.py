# SPDX-License-Identifier: BSD-3-Clause
"""Files of the command line: what is read is never written, and reports are read from anywhere."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import skidyn
from skidyn import cli


@pytest.fixture(scope="module")
def report(work, tmp_path_factory):
    """A report, its log and its robot in one folder, by relative names."""
    folder = tmp_path_factory.mktemp("reported")
    for name in ("log.csv", "arm.urdf"):
        shutil.copy(work / name, folder / name)
    before = os.getcwd()
    os.chdir(folder)
    try:
        words = ["diagnose", "log.csv", "--urdf", "arm.urdf", "--out", "report.json"]
        assert cli.main(words) == cli.DONE
    finally:
        os.chdir(before)
    return folder / "report.json"


@pytest.mark.parametrize(
    "words",
    [
        ["diagnose", "{log}", "--urdf", "{urdf}", "--out", "{log}"],
        ["diagnose", "{log}", "--urdf", "{urdf}", "--out", "{other}"],  # a glob of the shell
        ["diagnose", "{log}", "--urdf", "{urdf}", "--html", "{urdf}"],
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
    places = {
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


def test_a_report_is_read_from_another_folder(report, tmp_path, monkeypatch, run):
    monkeypatch.chdir(tmp_path)
    words = ("add", "--from", report, "--effect", "stribeck", "--joints", "2")
    code, errors = run(*words)
    assert code == cli.DONE and errors["before"]
    code, _ = run("compare", report, report)
    assert code == cli.DONE


def test_a_report_away_from_its_files_finds_them_here_or_by_urdf(
    report, tmp_path, monkeypatch, run, capsys
):
    (tmp_path / "reports").mkdir()
    alone = shutil.copy(report, tmp_path / "reports" / "report.json")
    words = ("add", "--from", alone, "--effect", "stribeck", "--joints", "2")
    monkeypatch.chdir(report.parent)
    assert run(*words)[0] == cli.DONE
    monkeypatch.chdir(tmp_path)
    shutil.copy(report.parent / "log.csv", "log.csv")
    assert cli.main([str(word) for word in words]) == cli.BAD_INPUT
    assert "--urdf names the description" in capsys.readouterr().err
    assert run(*words, "--urdf", report.parent / "arm.urdf")[0] == cli.DONE


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


@pytest.mark.parametrize(("name", "value"), [("columns", "[1]"), ("units", '["deg"]')])
def test_and_so_they_are_in_a_report(report, tmp_path, name, value, capsys):
    content = json.loads(report.read_text())
    content["provenance"]["options"][name] = value
    crafted = report.with_name(f"crafted_{name}.json")
    crafted.write_text(json.dumps(content))
    words = ["add", "--from", str(crafted), "--effect", "dahl"]
    assert cli.main(words) == cli.BAD_INPUT
    assert f"{name} is" in capsys.readouterr().err


@pytest.fixture
def evil_model(tmp_path):
    """A stored model that calls a function of skidyn which writes a file."""

    def node(loader, module, name, content):
        place = {"__loader__": loader, "__module__": module, "__class__": name}
        return {**place, "content": content, "protocol": 2}

    told = (str(tmp_path / "harm"), "harm")
    words = [node("JsonNode", "builtins", "str", json.dumps(word)) for word in told]
    given = node("TupleNode", "builtins", "tuple", words)
    crafted = node("ConstructorFromReduceNode", "skidyn._writing", "write_text", given)
    with zipfile.ZipFile(tmp_path / "evil.skops", "w") as archive:
        archive.writestr("schema.json", json.dumps(crafted))
    return tmp_path / "evil.skops"


def test_a_model_that_names_a_function_is_refused_by_the_commands(work, report, evil_model, capsys):
    words = ["compare", str(work / "log.csv"), "--urdf", str(work / "arm.urdf")]
    assert cli.main([*words, "--model", str(evil_model)]) == cli.BAD_INPUT
    assert "not trusted: skidyn._writing.write_text" in capsys.readouterr().err
    content = json.loads(report.read_text())
    content["provenance"]["options"]["model"] = str(evil_model)
    crafted = report.with_name("evil.json")
    crafted.write_text(json.dumps(content))
    assert cli.main(["add", "--from", str(crafted), "--effect", "dahl"]) == cli.BAD_INPUT
    assert "not trusted: skidyn._writing.write_text" in capsys.readouterr().err
    assert not (evil_model.parent / "harm").exists()


@pytest.mark.parametrize("text", ["[" * 100_000, '{"provenance": ' * 50_000, "NaN", "[1]", "\x00"])
def test_what_is_no_report_is_one_line(tmp_path, text, capsys):
    (tmp_path / "report.json").write_text(text)
    words = ["add", "--from", str(tmp_path / "report.json"), "--effect", "dahl"]
    assert cli.main(words) == cli.BAD_INPUT
    assert capsys.readouterr().err.count("\n") == 1


def shell(words, **options):
    """Run the command line in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "skidyn", *words], text=True, check=False, **options
    )


@pytest.mark.skipif(os.name != "posix", reason="another shell")
def test_closed_and_narrow_outputs_are_no_traceback(work):
    words = ["identify", str(work / "log.csv"), "--urdf", str(work / "arm.urdf")]
    ascii_only = os.environ | {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    done = shell(words, env=ascii_only, capture_output=True)
    assert done.returncode == cli.DONE and " +- " in done.stdout
    closed = subprocess.run(
        ["sh", "-c", 'exec "$0" -m skidyn effects >&-', sys.executable],
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    assert (closed.returncode, closed.stderr) == (cli.DONE, "")
    if os.path.exists("/dev/full"):
        with open("/dev/full", "w") as full:
            done = shell(["effects", "--json"], stdout=full, stderr=subprocess.PIPE)
        assert done.returncode == cli.BAD_INPUT
        assert "No space left" in done.stderr and "Traceback" not in done.stderr


@pytest.mark.parametrize("how", ["python -m skidyn", "skidyn"])
@pytest.mark.parametrize("module", ["skidyn.cli", "argparse", "numpy", "skidyn.identification"])
def test_ctrl_c_while_modules_are_imported_is_one_line(work, module, how):
    with open(Path(skidyn.__file__).parents[1] / "pyproject.toml", "rb") as file:
        home, _, name = tomllib.load(file)["project"]["scripts"]["skidyn"].partition(":")
    script = f"from {home} import {name}\nsys.exit({name}())\n"
    module_run = "import runpy\nrunpy.run_module('skidyn', run_name='__main__')\n"
    code = (
        "import sys\n"
        "class Stop:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        f"        if name == {module!r}: raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Stop())\n" + (script if how == "skidyn" else module_run)
    )
    words = ["compare", str(work / "log.csv"), "--urdf", str(work / "arm.urdf")]
    done = subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, check=False
    )
    assert done.returncode == cli.STOPPED
    assert done.stderr == "stopped; no file was left half written\n"
