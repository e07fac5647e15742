# SPDX-License-Identifier: BSD-3-Clause
"""What a terminal shows of a diagnosis."""

import pytest

from skidyn._commands._story import bar, story_lines


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
        "quiet": "Joint 1 is at its noise.", "left": "What is left is like the noise.",
    }  # fmt: skip


def test_the_verdict_comes_first_and_each_thing_once(story):
    text = "\n".join(story_lines(story))
    assert text.startswith("Missing: spring on joint 2.")
    for part in ("23 repeated rows", "k = 3.5", "Joint 1 is at its noise.", "2 axis2"):
        assert text.count(part) == 1
    assert "axis1" not in text


def test_a_doubt_about_the_log_comes_before_any_name(story):
    story["doubts"] = ["the torque of joint 2 has the other sign: evidence."]
    assert next(iter(story_lines(story))).startswith("Check the log first: the torque of joint 2")


def test_a_screen_holds_it(story):
    assert len(list(story_lines(story))) < 20


def test_joints_of_a_complete_model_are_all_listed(story):
    story |= {"findings": [], "joints": [joint(1, 0.1, 0.1, 0.1, False, "quiet")], "text": "Fine."}
    lines = list(story_lines(story))
    assert any("axis1" in line for line in lines) and "Fine." in lines


def test_a_bar_shows_before_after_and_noise():
    drawn = bar([4.0, 1.0], 4.0)
    assert len(drawn) == 24
    assert drawn.count(drawn[0]) == 6 and drawn[6] not in (drawn[0], drawn[-1])


def test_a_bar_without_numbers_is_empty():
    assert bar([float("nan"), float("nan")], 4.0).strip() in ("│", "|")
