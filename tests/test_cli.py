# SPDX-License-Identifier: BSD-3-Clause
"""The command line, as a user or a script runs it."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import skidyn
from skidyn import cli


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["diagnose", "none.csv", "--urdf", "none.urdf"], "no file none.urdf"),
        (["simulate", "--out", "log.xls"], "must end in .csv or .parquet"),
        (["simulate", "--robot", "r2d2", "--out", "log.csv"], "no embedded robot 'r2d2'"),
        (["simulate", "--effect", "dahll", "--out", "log.csv"], "Did you mean 'dahl'"),
        (["simulate", "--joints", "a,b", "--out", "log.csv"], "joints are numbers from 1"),
        (["add", "--from", "none.json", "--effect", "dahl"], "none.json"),
    ],
)
def test_wrong_input_is_one_line_and_an_exit_code(words, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(words) == cli.BAD_INPUT
    caught = capsys.readouterr()
    assert message in caught.err
    assert "Traceback" not in caught.err
    assert not list(tmp_path.iterdir())


def test_without_a_command_it_teaches(capsys):
    assert cli.main([]) == cli.BAD_INPUT
    assert "diagnose" in capsys.readouterr().out


def test_runs_as_a_module():
    done = subprocess.run(
        [sys.executable, "-m", "skidyn", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("skidyn ")


def test_a_reader_that_stops_early_is_no_error():
    words = [sys.executable, "-m", "skidyn", "effects", "--json"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        errors = process.stderr.read()
    assert (process.returncode, errors) == (cli.DONE, b"")


def test_every_command_teaches_with_an_example(capsys):
    with pytest.raises(SystemExit):
        cli.main(["--help"])
    names = re.findall(r"^    (\w+)(?: |$)", capsys.readouterr().out, re.MULTILINE)
    assert {"demo", "diagnose", "completion"} < set(names)
    for name in names:
        with pytest.raises(SystemExit) as stopped:
            cli.main([name, "--help"])
        text = capsys.readouterr().out
        assert stopped.value.code == 0
        assert f"  skidyn {name}" in text


@pytest.mark.parametrize("how", ["python -m skidyn", "skidyn"])
@pytest.mark.parametrize("module", ["skidyn.cli", "argparse", "numpy", "skidyn.robots"])
def test_ctrl_c_while_modules_are_imported_is_one_line(module, how):
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
    words = ["compare", "log.csv", "--urdf", "arm.urdf"]
    done = subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, check=False
    )
    assert done.returncode == cli.STOPPED
    assert done.stderr == "stopped; no file was left incomplete\n"
