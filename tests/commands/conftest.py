# SPDX-License-Identifier: BSD-3-Clause
"""A folder with a robot and its log, as commands read them."""

from __future__ import annotations

import json
import os
import shutil
from importlib.resources import files

import pytest

from skidyn import cli
from skidyn.datasets import load_planar_arm, make_hidden_effect_log


@pytest.fixture(scope="session")
def work(tmp_path_factory):
    pytest.importorskip("pandas", reason="needs skidyn[io]")
    folder = tmp_path_factory.mktemp("commands")
    urdf = files("skidyn.datasets").joinpath("robots", "planar_arm.urdf").read_text("utf-8")
    (folder / "arm.urdf").write_text(urdf, encoding="utf-8")
    options = {"joints": [2], "noise": "high", "n_trajectories": 6, "duration": 6.0}
    log = make_hidden_effect_log(load_planar_arm(), "maxwell_slip", random_state=5, **options)
    log.frame.to_csv(folder / "log.csv", index=False)
    return folder


@pytest.fixture(scope="session")
def diagnosed(tmp_path_factory):
    """A folder with a robot and a log that hides Stribeck friction on joint 2, diagnosed."""
    pytest.importorskip("pandas", reason="needs skidyn[io]")
    pytest.importorskip("jinja2", reason="needs skidyn[report]")
    folder = tmp_path_factory.mktemp("diagnosed")
    urdf = files("skidyn.datasets").joinpath("robots", "planar_arm.urdf").read_text("utf-8")
    (folder / "arm.urdf").write_text(urdf, encoding="utf-8")
    log = make_hidden_effect_log(
        load_planar_arm(), "stribeck", joints=[2], n_trajectories=6, duration=7.0
    )
    log.frame.to_csv(folder / "log.csv", index=False)
    words = ["diagnose", str(folder / "log.csv"), "--urdf", str(folder / "arm.urdf")]
    written = ["--out", str(folder / "report.json"), "--html", str(folder / "report.html")]
    assert cli.main([*words, *written]) == cli.DONE
    return folder


@pytest.fixture
def arguments(diagnosed):
    """Log and robot of that folder, as words of a command."""
    return [str(diagnosed / "log.csv"), "--urdf", str(diagnosed / "arm.urdf")]


@pytest.fixture
def run(capsys):
    def run_command(*words):
        code = cli.main([*map(str, words), "--json"])
        out = capsys.readouterr().out
        return code, json.loads(out) if out.strip() else None

    return run_command


@pytest.fixture(scope="session")
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


@pytest.fixture(scope="session")
def servo_diagnosed(sticky_servo, tmp_path_factory):
    """A folder with a log of servos without torque, diagnosed, and the words that did it."""
    pytest.importorskip("jinja2", reason="needs skidyn[report]")
    folder = tmp_path_factory.mktemp("servos")
    urdf = files("skidyn.datasets").joinpath("robots", "planar_arm.urdf").read_text("utf-8")
    (folder / "arm.urdf").write_text(urdf, encoding="utf-8")
    sticky_servo.log.to_csv(folder / "log.csv", index=False)
    gains = '{"stiffness": [200, 12], "damping": [12, 0.6], "follows_velocity": false}'
    words = ["diagnose", str(folder / "log.csv"), "--urdf", str(folder / "arm.urdf")]
    words += ["--controller", gains, "--effects", "spring"]
    words += ["--out", str(folder / "report.json"), "--html", str(folder / "report.html")]
    assert cli.main(words) == cli.DONE
    return words


@pytest.fixture
def flipped_log(work, tmp_path):
    """A log in which one torque has the opposite sign, and its robot, as words of a command."""
    pandas = pytest.importorskip("pandas", reason="needs skidyn[io]")
    frame = pandas.read_csv(work / "log.csv")
    frame["tau2"] = -frame["tau2"]
    frame.to_csv(tmp_path / "flipped.csv", index=False)
    return [str(tmp_path / "flipped.csv"), "--urdf", str(work / "arm.urdf")]
