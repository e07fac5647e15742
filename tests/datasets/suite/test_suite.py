# SPDX-License-Identifier: BSD-3-Clause
"""The suite: drawn by seed, simulated by MuJoCo, silent about the truth."""

import json
from collections import Counter

import pytest

pytest.importorskip("mujoco", reason="the suite is simulated by MuJoCo")
pytest.importorskip("pandas")

from skidyn.datasets import hidden_effect_suite
from skidyn.exceptions import SkidynError


def test_a_seed_draws_the_same_logs_and_a_larger_suite_goes_on():
    suite = hidden_effect_suite(5, 40)
    assert suite[:10] == hidden_effect_suite(5, 10)
    assert suite != hidden_effect_suite(6, 40)
    assert [c.name for c in suite[:2]] == ["case_000", "case_001"]


def test_every_tier_and_content_is_drawn_in_its_share():
    suite = hidden_effect_suite(0, 400)
    assert set(Counter(c.tier for c in suite)) == {"low", "high", "hard", "short", "rough"}
    share = Counter(c.content for c in suite)
    assert share["nothing"] == pytest.approx(80, abs=25)
    assert share["one"] > share["nameless"] > share["once"] > 0
    assert all(len(c.kinds) == {"nothing": 0, "two": 2}.get(c.content, 1) for c in suite)


def test_only_what_was_asked_for():
    suite = hidden_effect_suite(1, 20, tiers=["rough"], contents=["nothing", "once"])
    assert {c.tier for c in suite} == {"rough"}
    assert {c.content for c in suite} == {"nothing", "once"}
    with pytest.raises(SkidynError, match="tier dreadful does not exist; known: low"):
        hidden_effect_suite(1, tiers=["dreadful"])
    with pytest.raises(SkidynError, match="at least 1"):
        hidden_effect_suite(1, 0)


@pytest.mark.slow
def test_files_say_nothing_of_the_truth(written):
    names = sorted(p.name for p in written.case.iterdir())
    assert names == ["log.parquet", "meta.json", "robot.urdf"]
    assert "offset" not in (written.case / "meta.json").read_text()
    assert json.loads(written.truth.read_text())["effects"][0]["kind"] == "offset"
