# SPDX-License-Identifier: BSD-3-Clause
"""What commands read: logs, models and reports."""

import json

import pytest

from skidyn import cli
from skidyn.datasets import load_planar_arm, make_hidden_effect_log


def test_a_log_that_changed_since_the_report_is_reported(diagnosed, tmp_path, capsys):
    report = json.loads((diagnosed / "report.json").read_text("utf-8"))
    report["provenance"]["sha256"] = dict.fromkeys(report["provenance"]["sha256"], "0")
    (tmp_path / "old.json").write_text(json.dumps(report), encoding="utf-8")
    words = ["add", "--from", str(tmp_path / "old.json"), "--effect", "spring", "--joints", "1"]
    assert cli.main(words) == cli.DONE
    assert "log.csv has changed since" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["not json", "[]", "{}", '{"provenance": 3}'])
def test_a_file_that_is_no_report_is_refused(tmp_path, capsys, text):
    (tmp_path / "x.json").write_text(text, encoding="utf-8")
    words = ["report", "--from", str(tmp_path / "x.json"), "--html", str(tmp_path / "x.html")]
    assert cli.main(words) == cli.BAD_INPUT
    assert "x.json" in capsys.readouterr().err
    assert not (tmp_path / "x.html").exists()


def test_the_model_must_have_a_rigid_body(capsys, arguments):
    assert cli.main(["compare", *arguments, "--model", "viscous"]) == cli.BAD_INPUT
    assert "must contain rigid_body" in capsys.readouterr().err


def test_currents_become_torques_by_drive_gains(diagnosed, tmp_path, run):
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=4.0)
    frame = log.frame.rename(columns={"tau1": "i1", "tau2": "i2"})
    frame[["i1", "i2"]] = frame[["i1", "i2"]] / [10.0, 5.0]
    frame.to_csv(tmp_path / "currents.csv", index=False)
    words = ["compare", str(tmp_path / "currents.csv"), "--urdf", str(diagnosed / "arm.urdf")]
    code, result = run(*words, "--drive-gains", "[10, 5]")
    assert code == cli.DONE
    assert max(row["relative"] for row in result["table"]) < 0.5
