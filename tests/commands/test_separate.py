# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn separate``."""

from __future__ import annotations

import json

import pandas as pd

from skidyn import cli
from skidyn.exceptions import EffectError


def test_the_motion_and_its_worth(report, run, tmp_path, monkeypatch):
    # the best motion is a matter of its own test
    monkeypatch.setattr("skidyn.diagnosis._separation.ROUNDS", 2)
    out = tmp_path / "motion.csv"

    code, answer = run("separate", "--from", report, "--out", out, "--duration", 10)

    assert code == cli.DONE
    assert answer["joints"] == [2]
    assert answer["gain"] > answer["gain_of_log"]
    assert {answer["kind"], answer["rival"]} <= {"dahl", "lugre", "maxwell_slip"}
    assert pd.read_csv(out)["time"].iloc[-1] < 10


def refused(report, out, capsys, *more):
    words = ["separate", "--from", report, "--out", out, *more]
    assert cli.main([*map(str, words)]) == cli.BAD_INPUT
    assert not out.exists()
    return capsys.readouterr().err


def test_a_report_without_rivals_is_refused_without_a_search(report, tmp_path, capsys, monkeypatch):
    def search(*_, **__):
        raise AssertionError("the report tells it")

    monkeypatch.setattr("skidyn._commands._separate.run_diagnosis", search)
    out = tmp_path / "motion.csv"
    told = refused(report, out, capsys, "--effect", "payload")
    assert "no finding payload" in told and "maxwell_slip from dahl" in told

    content = json.loads(report.read_text("utf-8"))
    for effect in content["effects"]:
        effect["rivals"] = ["unknown"]
    bare = report.with_name("bare.json")
    bare.write_text(json.dumps(content), encoding="utf-8")
    assert "nothing to separate: no finding has a rival" in refused(bare, out, capsys)


def test_effects_of_the_report_are_searched_before_all_others(report, tmp_path, monkeypatch):
    searched = []

    def search(*_, kinds, **__):
        searched.append(kinds)
        raise EffectError("found something else")

    monkeypatch.setattr("skidyn._commands._separate.run_diagnosis", search)
    out = tmp_path / "motion.csv"
    assert cli.main(["separate", "--from", str(report), "--out", str(out)]) == cli.BAD_INPUT
    among, every = searched
    assert {"dahl", "maxwell_slip"} <= set(among) <= {"dahl", "lugre", "maxwell_slip"}
    assert every is None
