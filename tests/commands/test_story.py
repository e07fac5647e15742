# SPDX-License-Identifier: BSD-3-Clause
"""What a terminal shows of a diagnosis."""

from __future__ import annotations

import copy
import sys

import pytest

from skidyn import cli, diagnosis
from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import Failure, Place
from skidyn.identification import RBDRegressor


@pytest.fixture(scope="module")
def short(work, tmp_path_factory):
    """Words that name a short log and its robot, and its diagnosis."""
    file = tmp_path_factory.mktemp("story") / "log.csv"
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=3.0)
    log.frame.to_csv(file, index=False)
    words = [str(file), "--urdf", str(work / "arm.urdf"), "--no-cache"]
    return words, diagnosis.diagnose(RBDRegressor(log.robot), log.X, log.y, effects=[])


@pytest.fixture
def shown(short, monkeypatch, capsys):
    """Lines printed of a made-up story; only a terminal breaks them.

    Next commands are left out unless there are more options.
    """
    words, found = short

    def show(story, failures=(), columns=120, terminal=False, more=()):
        told = copy.copy(found)
        told.story, told.failures = lambda: story, list(failures)
        monkeypatch.setattr(diagnosis, "diagnose", lambda *args, **options: told)
        monkeypatch.setenv("COLUMNS", str(columns))
        monkeypatch.setattr(sys.stdout, "isatty", lambda: terminal)
        assert cli.main(["diagnose", *words, *more]) == cli.DONE
        out = capsys.readouterr().out
        return (out if more else out.partition("next: ")[0]).splitlines()

    return show


def joint(number, before, after, noise, speaks=True, state="better"):
    return {
        "joint": number, "name": f"axis{number}", "unit": "N m", "before": before, "after": after,
        "noise": noise, "ratios": [before / noise, after / noise], "speaks": speaks, "state": state,
    }  # fmt: skip


@pytest.fixture
def story():
    return {
        "headline": "Missing: spring on joint 2", "text": "", "warnings": ["23 repeated rows"],
        "doubts": [],
        "findings": [{"what": "Spring", "where": "joint 2", "size": "k = 3.5 ± 0.4 N m/rad",
                      "sure": "no other effect explains it as well",
                      "change": "0.63 → 0.16 N m (noise 0.16)"}],
        "joints": [joint(1, 0.1, 0.1, 0.1, False, "quiet"), joint(2, 0.63, 0.16, 0.16)],
        "quiet": "Joint 1 is at its noise.", "left": "The remaining error is at the noise level.",
    }  # fmt: skip


def test_the_verdict_comes_first_and_each_thing_once(story, shown):
    text = "\n".join(shown(story))
    assert text.startswith("Missing: spring on joint 2.")
    for part in ("23 repeated rows", "k = 3.5", "Joint 1 is at its noise.", "axis2 (2)"):
        assert text.count(part) == 1
    assert "axis1" not in text


def test_what_is_uncertain_is_told_apart_and_not_proposed(story, shown, tmp_path):
    (sure,) = story["findings"]
    sure |= {"kind": "spring", "joints": [2], "guess": False}
    guess = sure | {"what": "Torque ripple", "kind": "torque_ripple", "guess": True}
    story |= {"servo_motion": None, "findings": [sure, guess]}
    more = ("--out", str(tmp_path / "report.json"))
    lines = shown(story, more=more)
    at = [lines.index(head) for head in lines if head.startswith(("What is", "Uncertain"))]
    assert lines[at[0] + 1].startswith("  1. Spring")
    assert lines[at[1] + 1].startswith("  2. Torque ripple")
    assert [line for line in lines if "--effect" in line][0].endswith("spring --joints 2")
    story["findings"] = [guess]
    assert not [line for line in shown(story, more=more) if "--effect" in line]


def test_the_simulated_motion_is_told_where_it_was_asked_for(story, shown):
    error = {"position": 0.0123, "final": 0.02, "velocity": 0.11}
    story["simulation"] = {
        "heading": "Simulated motion, 1 s at a time, on recordings left out of the fit",
        "text": "The error of the simulated motion falls: -37 %.", "added": True,
        "joints": [{"joint": 1, "name": "axis1", "unit": "rad", "before": error,
                    "after": {**error, "position": 0.0045}, "without_forces": 0.34}],
    }  # fmt: skip
    lines = shown(story)
    (row,) = [line for line in lines if "rad/s" in line]
    assert row.split() == ["axis1", "(1)", *"0.012 0.0045 rad 0.11 0.11 rad/s 0.34 rad".split()]
    assert "  The error of the simulated motion falls: -37 %." in lines
    story["simulation"] |= {"added": False, "text": ""}
    (row,) = [line for line in shown(story) if "rad/s" in line]
    assert row.split() == ["axis1", "(1)", *"0.012 rad 0.11 rad/s 0.34 rad".split()]


def test_a_doubt_about_the_log_comes_before_any_name(story, shown):
    story["doubts"] = ["the torque of joint 2 has the opposite sign: evidence."]
    assert shown(story)[0].startswith("Check the log first: the torque of joint 2")


def test_a_screen_holds_it(story, shown):
    assert len(shown(story)) < 20


def test_a_screen_holds_several_findings_on_many_joints(story, shown):
    line = {
        "what": "Load-dependent friction", "where": "joints 2 and 3",
        "size": "mu = 0.064 ± 0.0052 (joint 2), mu = 0.072 ± 0.0064 (joint 3)",
        "sure": "confidence 88%; this data cannot separate it from LuGre friction",
        "change": "joint 3: 2.5 → 2.1 N m (noise 1.2)",
    }  # fmt: skip
    place = Place("regime", "at high speed", 0.55, 0.3, regime="fast")
    failures = [
        Failure(j, f"axis{j}", 0.6, 0.1, 6.0, (place,) if j < 3 else (), "") for j in range(1, 7)
    ]
    story |= {"findings": [line] * 4, "joints": [joint(j, 0.6, 0.2, 0.1) for j in range(1, 7)]}
    lines = shown(story, failures, columns=100, terminal=True)
    assert len(lines) < 34
    assert "  joint 1: 55% at high speed (30% of the time)" in lines
    assert "  joints 3, 4, 5 and 6: spread over the whole motion" in lines


def test_a_long_name_keeps_its_number(story, shown):
    story["joints"][1]["name"] = "the_joint_" * 8
    (row,) = [text for text in shown(story) if "the_joint" in text]
    assert "... (2)" in row


def test_joints_of_a_complete_model_are_all_listed(story, shown):
    story |= {"findings": [], "joints": [joint(1, 0.1, 0.1, 0.1, False, "quiet")], "text": "Fine."}
    lines = shown(story)
    assert any("axis1" in line for line in lines) and "Fine." in lines


def test_a_bar_shows_before_after_and_noise(story, shown):
    story["joints"][1] = joint(2, 0.4, 0.1, 0.1)
    (row,) = [line for line in shown(story) if "axis2" in line]
    drawn = row.split()[-1]
    assert len(drawn) == 24
    assert drawn.count(drawn[0]) == 6 and drawn[6] not in (drawn[0], drawn[-1])


def test_a_bar_without_numbers_is_empty(story, shown):
    story["joints"][1] |= {"ratios": [float("nan"), float("nan")]}
    (row,) = [line for line in shown(story) if "axis2" in line]
    assert row.partition("N m")[2].strip() in ("│", "|")


def test_a_usual_terminal_has_room_for_bars(story, shown):
    story["joints"][1]["name"] = "shoulder_lift_joint"
    lines = shown(story, columns=80)
    (row,) = [line for line in lines if "shoulder_lift_joint (2)" in line]
    assert "│" in row or "|" in row
    assert max(map(len, lines[2:5])) <= 80
