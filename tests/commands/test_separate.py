# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn separate``."""

from __future__ import annotations

import pandas as pd
import pytest

from skidyn import cli


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


@pytest.mark.slow
def test_rivals_that_were_not_compared(report, tmp_path, capsys):
    out = tmp_path / "motion.csv"
    words = ["separate", "--from", report, "--out", out, "--effect", "payload"]

    assert cli.main([*map(str, words)]) == cli.BAD_INPUT
    assert "the search compared" in capsys.readouterr().err
    assert not out.exists()
