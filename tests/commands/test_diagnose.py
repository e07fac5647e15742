# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn diagnose``."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from skidyn import cli, datasets
from skidyn.cli import main
from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import Diagnosis


@pytest.mark.slow
def test_findings_are_judged_by_simulation_where_it_is_asked_for(work, run, saved, monkeypatch):
    judged = []
    given = Diagnosis.judge_by_simulation
    monkeypatch.setattr(
        Diagnosis, "judge_by_simulation", lambda self: judged.append(given(self)) or judged[-1]
    )
    log = make_hidden_effect_log(load_planar_arm(), "spring", n_trajectories=4, duration=2.0)
    words = ("diagnose", saved(log.frame), "--urdf", work / "arm.urdf", "--effects", "spring")

    code, report = run(*words, "--simulate")

    assert code == cli.DONE
    assert len(judged) == 1 and len(judged[0]) == len(report["effects"]) == 1
    assert not [note for note in report["warnings"] if "worsens the simulated" in note]
    motion = report["simulation"]
    assert len(motion["before"]["position"]) == len(motion["after"]["velocity"]) == 2
    assert report["effects"][0]["simulation"]["added"]


def test_diagnose_writes_report_and_page(diagnosed):
    report = json.loads((diagnosed / "report.json").read_text("utf-8"))
    assert report["schema"] == "skidyn.diagnosis/1"
    assert report["verdict"] == "missing"
    assert [(e["kind"], e["joints"]) for e in report["effects"]] == [("stribeck", [2])]
    assert set(report["provenance"]["sha256"]) == {
        str(diagnosed / "log.csv"),
        str(diagnosed / "arm.urdf"),
    }
    assert "executable" not in report["provenance"]["versions"]
    assert "</html>" in (diagnosed / "report.html").read_text("utf-8")


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is another thing there")
def test_ctrl_c_leaves_no_half_written_file(tmp_path, arguments):
    """A real signal to a real process, while it works."""
    out, page = tmp_path / "report.json", tmp_path / "report.html"
    words = ["diagnose", *arguments, "--jobs", "2", "--out", str(out), "--html", str(page)]
    process = subprocess.Popen(
        [sys.executable, "-c", STOPPABLE, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    process.stdout.readline()  # the report is written beside its place, and not yet put there
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=120)
    assert (process.returncode, errors.decode().splitlines()[-1]) == (
        cli.STOPPED,
        "stopped; no file was left incomplete",
    )
    assert list(tmp_path.iterdir()) == []


STOPPABLE = """
import os, signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # a background shell ignores it
from skidyn.cli import main

def slow(*paths):
    print("now", flush=True)
    time.sleep(60)

os.replace = slow
sys.exit(main(sys.argv[1:]))
"""
URDF = str(Path(datasets.__file__).parent / "robots" / "planar_arm.urdf")
LOG = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=4.0).frame


@pytest.fixture
def flipped(tmp_path):
    path = tmp_path / "log.csv"
    LOG.assign(dq2=-LOG["dq2"]).to_csv(path, index=False)
    return str(path)


def test_diagnose_stops_with_the_remedy_unless_forced(flipped, tmp_path, capsys):
    assert main(["diagnose", flipped, "--urdf", URDF]) == 2
    assert "--flip dq2" in capsys.readouterr().err
    out = str(tmp_path / "report.json")
    assert main(["diagnose", flipped, "--urdf", URDF, "--force", "--out", out]) == 0
    with open(out) as file:
        report = json.load(file)
    assert report["checks"][0]["certainty"] == "certain"
    assert report["provenance"]["options"]["force"] is True


def test_stamps_that_certainly_jitter_are_replaced_by_even_steps_and_this_is_told(tmp_path, capsys):
    path, out = str(tmp_path / "log.csv"), str(tmp_path / "report.json")
    noise = np.random.default_rng(0).uniform(-1e-3, 1e-3, len(LOG))
    LOG.assign(time=LOG["time"] + noise).to_csv(path, index=False)
    words = ["diagnose", path, "--urdf", URDF, "--out", out]
    for _ in range(2):  # the second answer is the one that was kept
        assert main(words) == 0
        assert "the time stamps jitter" in capsys.readouterr().out
        report = json.loads(Path(out).read_text("utf-8"))
        assert report["verdict"] == "complete"
        assert report["provenance"]["options"]["clock"] == "regular"
        told = report["checks"][0]
        assert (told["check"], told["certainty"]) == ("clock_jitter", "noted")
        assert "even steps were used" in told["evidence"]
    assert main([*words, "--clock", "recorded"]) == 2
    assert "--clock regular" in capsys.readouterr().err


@pytest.mark.slow
def test_servos_without_torque_are_diagnosed_by_their_motion(servo_diagnosed, capsys):
    folder = Path(servo_diagnosed[1]).parent
    report = json.loads((folder / "report.json").read_text("utf-8"))
    (found,) = report["servo_motion"]
    assert (found["kind"], found["joint"]) == ("stribeck", 2)
    jsonschema = pytest.importorskip("jsonschema")
    schema = resources.files("skidyn.report").joinpath("diagnosis.schema.json")
    jsonschema.validate(report, json.loads(schema.read_text()))
    page = (folder / "report.html").read_text("utf-8")
    assert '<section id="servos">' in page and 'href="#servos"' in page
    assert main(servo_diagnosed) == cli.DONE  # the answer that was kept
    told = capsys.readouterr().out
    assert "the motion of the servos shows Stribeck friction on joint 2" in told
    assert "Stribeck friction on joint 2: dF = 0.1" in told
    assert "The torque is computed from the servos" in told
    assert "--effect stribeck --joints 2" in told


@pytest.mark.slow
def test_a_report_of_servos_is_read_again_with_its_controller(servo_diagnosed, run):
    report = Path(servo_diagnosed[1]).parent / "report.json"
    code, errors = run("add", "--from", report, "--effect", "stribeck", "--joints", "2")
    assert code == cli.DONE and errors["after"][1] < errors["before"][1]


def test_servos_are_read_by_their_weight_or_by_the_measured_torque(tmp_path, run, capsys):
    servo = LOG[LOG["trajectory"] <= 2].copy()
    for j in (1, 2):  # a servo of 40 N m/rad: its error is the torque over its gain
        servo[f"q_ref{j}"] = servo[f"q{j}"] + servo[f"tau{j}"] / 40.0
    servo.to_csv(tmp_path / "whole.csv", index=False)
    servo.drop(columns=["tau1", "tau2"]).to_csv(tmp_path / "bare.csv", index=False)
    words = ("--urdf", URDF, "--effects", "spring")
    for name, by_weight in (("whole", False), ("bare", True)):
        code, report = run("diagnose", tmp_path / f"{name}.csv", *words, "--controller", "fit")
        assert code == cli.DONE and report["servo_motion"] is None
        told = " ".join(report["warnings"])
        assert "the log holds 2 piece(s)" in told
        assert ("The torque is computed from the servos" in told) == by_weight
    assert main(["diagnose", str(tmp_path / "bare.csv"), *words]) == cli.BAD_INPUT
    assert "--controller fit" in capsys.readouterr().err
