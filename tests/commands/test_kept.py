# SPDX-License-Identifier: BSD-3-Clause
"""Answers of ``skidyn diagnose`` that are kept beside the log."""

from __future__ import annotations

import shutil

import pytest

from skidyn import cli
from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import Diagnosis

AGAIN = "stored result of an earlier identical diagnosis"
#: Short, because every test searches it twice at least.
LOG = {"joints": [2], "n_trajectories": 3, "duration": 3.0}


@pytest.fixture
def ask(work, tmp_path, capsys, monkeypatch):
    """Diagnose a log of one's own; what is printed, the page, and how often a search was made."""
    shutil.copy(work / "arm.urdf", tmp_path)
    log = make_hidden_effect_log(load_planar_arm(), "stribeck", **LOG)
    log.frame.to_csv(tmp_path / "log.csv", index=False)
    told = []
    given = Diagnosis.story
    monkeypatch.setattr(Diagnosis, "story", lambda self: told.append(1) or given(self))

    def asked(*words):
        before = len(told)
        paths = [tmp_path / "report.json", tmp_path / "page.html"]
        for path in paths:
            path.unlink(missing_ok=True)
        files = ["--out", str(paths[0]), "--html", str(paths[1])]
        question = ["diagnose", str(tmp_path / "log.csv"), "--urdf", str(tmp_path / "arm.urdf")]
        assert cli.main([*question, "--effects", "stribeck", *files, *words]) == cli.DONE
        printed = capsys.readouterr()
        assert (AGAIN in printed.out) == (len(told) == before)
        lines = [line for line in printed.out.splitlines() if AGAIN not in line]
        return (lines, printed.err, *(p.read_text("utf-8") for p in paths)), len(told) > before

    return asked


def test_the_same_question_has_the_same_answer_at_once(ask):
    first, searched = ask()
    second, again = ask()
    assert searched and not again
    assert second == first


@pytest.mark.slow
def test_another_log_or_robot_or_question_is_another(ask, tmp_path):
    ask()
    log, robot = tmp_path / "log.csv", tmp_path / "arm.urdf"
    assert ask("--model", "rigid_body")[1]
    same = log.read_text("utf-8").replace(",1,", "0,1,", 1)  # a time with one digit more
    log.write_text(same, encoding="utf-8")
    assert ask()[1]
    robot.write_text(robot.read_text("utf-8") + "<!-- the same arm -->", encoding="utf-8")
    assert ask()[1]
    assert not ask()[1]


@pytest.mark.slow
def test_nothing_is_kept_where_it_is_not_wanted(ask, tmp_path):
    assert ask("--no-cache")[1]
    assert not (tmp_path / ".skidyn").exists()
    ask()
    assert ask("--no-cache")[1]


@pytest.mark.slow
def test_a_damaged_answer_is_none(ask, tmp_path):
    first, _ = ask()
    (kept,) = (tmp_path / ".skidyn").iterdir()
    whole = kept.read_bytes()
    for damaged in (b"", b"{}", whole[: len(whole) // 2]):
        kept.write_bytes(damaged)
        assert ask() == (first, True)


def test_an_answer_that_cannot_be_kept_is_given(ask, tmp_path):
    (tmp_path / ".skidyn").write_text("a file in the place of the folder")
    first, _ = ask()
    assert ask() == (first, True)
