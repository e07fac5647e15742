# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn compare --fail-above``."""

from xml.etree import ElementTree

import pytest

pandas = pytest.importorskip("pandas", reason="needs skidyn[io]")

from skidyn import cli  # noqa: E402

ARM = ("--urdf", "arm.urdf")


@pytest.fixture
def here(work, monkeypatch):
    monkeypatch.chdir(work)
    frame = pandas.read_csv("log.csv")
    healthy = frame["trajectory"] <= 3
    frame[healthy].to_csv("healthy.csv", index=False)
    frame[~healthy].to_csv("tonight.csv", index=False)
    worn = frame[~healthy].copy()
    worn["tau1"] += 3.0 * worn["dq1"]
    worn.to_csv("worn.csv", index=False)
    return work


def test_an_unchanged_robot_passes(here, run):
    code, result = run(
        "compare", "tonight.csv", *ARM, "--against", "healthy.csv", "--fail-above", 2
    )
    assert code == cli.DONE
    assert result["passed"] and not any(j["failed"] for j in result["joints"])
    assert all(0.5 < j["ratio"] < 2 for j in result["joints"])


def test_a_worn_joint_fails_by_name(here, capsys, tmp_path):
    report = tmp_path / "gate.xml"
    words = ["compare", "worn.csv", *ARM, "--against", "healthy.csv"]
    assert cli.main([*words, "--fail-above", "2", "--junit", str(report)]) == cli.FAILED
    told = capsys.readouterr().out
    assert "failed: the error of joint1 is above 2 times the usual one" in told
    tests = ElementTree.parse(report).getroot()
    assert tests.get("failures") == "1"
    failures = {t.get("name"): t.find("failure") is not None for t in tests.iter("testcase")}
    assert failures == {"joint1": True, "joint2": False}


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--fail-above", "2"], "needs a healthy recording"),
        (["--junit", "x.xml"], "give both"),
        (["--against", "healthy.csv", "--fail-above", "0"], "above 0"),
        (["--against", "healthy.csv", "--fail-above", "2", "--html", "x.html"], "makes no page"),
    ],
)
def test_what_is_missing_is_said(here, capsys, words, complaint):
    assert cli.main(["compare", "tonight.csv", *ARM, *words]) == cli.BAD_INPUT
    assert complaint in capsys.readouterr().err


def test_one_healthy_recording_is_refused_in_one_line(here, capsys):
    frame = pandas.read_csv("healthy.csv")
    one = frame[frame["trajectory"] == 1].copy()
    one["tau2"] = -one["tau2"]  # which a check would tell at length
    one.to_csv("one.csv", index=False)
    words = ["compare", "tonight.csv", *ARM, "--fail-above", "2", "--against"]
    assert cli.main([*words, "one.csv"]) == cli.BAD_INPUT
    told = capsys.readouterr().err
    assert "give at least two" in told and "warning" not in told
    frame.assign(tau2=-frame["tau2"]).to_csv("flipped.csv", index=False)
    assert cli.main([*words, "flipped.csv"]) == cli.FAILED
    assert "warning: " in capsys.readouterr().err
