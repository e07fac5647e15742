# SPDX-License-Identifier: BSD-3-Clause
"""What commands read: logs, models and reports."""

from __future__ import annotations

import json
import re
import shutil
import warnings
import zipfile
from importlib.resources import files

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


def test_a_folder_that_changed_since_the_report_is_reported(tmp_path, monkeypatch, capsys):
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=3.0).frame
    urdf = files("skidyn.datasets").joinpath("robots", "planar_arm.urdf").read_text("utf-8")
    (tmp_path / "arm.urdf").write_text(urdf, encoding="utf-8")
    (tmp_path / "runs").mkdir()
    for k, run in log.groupby("trajectory"):
        run.assign(tau2=-run["tau2"]).to_csv(tmp_path / "runs" / f"run{k}.csv", index=False)
    monkeypatch.chdir(tmp_path)
    words = ["diagnose", "runs/", "--urdf", "arm.urdf", "--flip", "joint2", "--effects", "spring"]
    assert cli.main([*words, "--out", "r.json", "--html", "r.html"]) == cli.DONE
    provenance = json.loads((tmp_path / "r.json").read_text("utf-8"))["provenance"]
    assert set(provenance["sha256"]) == {"runs/", "arm.urdf"}
    note = f"flip: the sign of tau2 was changed in {len(log)} of {len(log)} rows"
    assert any(line.startswith(note) for line in provenance["notes"])
    assert note in (tmp_path / "r.html").read_text("utf-8")
    words = ["add", "--from", "r.json", "--effect", "spring", "--joints", "1"]
    assert cli.main(words) == cli.DONE
    assert "has changed" not in capsys.readouterr().err
    run.to_csv(tmp_path / "runs" / "run1.csv", index=False)
    assert cli.main(words) == cli.DONE
    assert "runs has changed since" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["not json", "[]", "{}", '{"provenance": 3}'])
def test_a_file_that_is_no_report_is_refused(tmp_path, capsys, text):
    (tmp_path / "x.json").write_text(text, encoding="utf-8")
    words = ["report", "--from", str(tmp_path / "x.json"), "--html", str(tmp_path / "x.html")]
    assert cli.main(words) == cli.BAD_INPUT
    assert "x.json" in capsys.readouterr().err
    assert not (tmp_path / "x.html").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["add", "--from", "nope.json", "--effect", "dahl"], "no file nope.json; --from must name"),
        (["check", "a.csv", "--units", "deg"], "not NAME=VALUE, for example --units q=deg,time=ms"),
        (
            ["check", "a.csv", "--drive-gains", "0.6,0.5"],
            "expected for example --drive-gains '[0.6",
        ),
    ],
)
def test_a_value_that_cannot_be_read_is_answered_by_an_example(tmp_path, capsys, words, said):
    (tmp_path / "a.csv").write_text("time,q1\n0,0\n", encoding="utf-8")
    words = [str(tmp_path / word) if word == "a.csv" else word for word in words]
    assert cli.main(words) == cli.BAD_INPUT
    assert said in capsys.readouterr().err


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
    assert "--urdf must name the description" in capsys.readouterr().err
    assert run(*words, "--urdf", report.parent / "arm.urdf")[0] == cli.DONE


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("columns", "[1]"),
        ("units", '["deg"]'),
        ("logs", [5]),
        ("logs", "log.csv"),
        ("urdf", None),
        ("model", 1),
        ("joints", ["a"]),
    ],
)
def test_options_of_other_types_in_a_report_are_one_line(report, tmp_path, name, value, capsys):
    content = json.loads(report.read_text())
    content["provenance"]["options"][name] = value
    crafted = report.with_name(f"crafted_{name}.json")
    crafted.write_text(json.dumps(content))
    words = ["add", "--from", str(crafted), "--effect", "dahl"]
    assert cli.main(words) == cli.BAD_INPUT
    assert re.search(f"{name}( of the diagnosis)? is", capsys.readouterr().err)


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
    assert "untrusted types: skidyn._writing.write_text" in capsys.readouterr().err
    content = json.loads(report.read_text())
    content["provenance"]["options"]["model"] = str(evil_model)
    crafted = report.with_name("evil.json")
    crafted.write_text(json.dumps(content))
    assert cli.main(["add", "--from", str(crafted), "--effect", "dahl"]) == cli.BAD_INPUT
    assert "untrusted types: skidyn._writing.write_text" in capsys.readouterr().err
    assert not (evil_model.parent / "harm").exists()


@pytest.mark.parametrize("text", ["[" * 100_000, '{"provenance": ' * 50_000, "NaN", "[1]", "\x00"])
def test_what_is_no_report_is_one_line(tmp_path, text, capsys):
    (tmp_path / "report.json").write_text(text)
    words = ["add", "--from", str(tmp_path / "report.json"), "--effect", "dahl"]
    assert cli.main(words) == cli.BAD_INPUT
    assert capsys.readouterr().err.count("\n") == 1


def test_a_report_makes_no_command_write_where_it_says(secret):
    secret, names = secret
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=4, duration=4.0)
    log.frame.to_csv("log.csv", index=False)
    urdf = files("skidyn.datasets") / "robots" / "planar_arm.urdf"
    evil = {"logs": ["log.csv"], "urdf": str(urdf), "model": "rigid_body"}
    evil |= {"out": names[1], "html": names[1], "save": names[1], "func": "os.remove"}
    with open("report.json", "w") as file:
        json.dump({"verdict": "complete", "provenance": {"options": evil, "sha256": {}}}, file)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the log differs from the one of the report
        cli.main(["add", "--from", "report.json", "--effect", "coulomb"])
    assert secret.read_text() == "the secret"
