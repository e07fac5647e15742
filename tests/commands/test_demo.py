# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn demo``."""

from __future__ import annotations

import re

import pytest

from skidyn import cli, datasets
from skidyn.datasets import load_planar_arm, make_hidden_effect_log


@pytest.fixture
def small(monkeypatch):
    """A log of two joints instead of that of seven, which takes longer."""
    log = make_hidden_effect_log(
        load_planar_arm(), "spring", joints=[2], n_trajectories=6, duration=5.0
    )
    monkeypatch.setattr(datasets, "load_demo_log", lambda: log)


def test_the_loop_is_told_step_by_step_and_ends_with_a_page(small, tmp_path, capsys):
    pytest.importorskip("jinja2", reason="needs skidyn[report]")
    page = tmp_path / "demo.html"
    assert cli.main(["demo", "--html", str(page)]) == cli.DONE
    told = capsys.readouterr().out
    assert re.findall(r"^(\d)\.", told, re.MULTILINE) == list("123456")
    found, hidden = re.findall(r"Spring on joint 2: k = (\S+)", told)
    assert float(found) == pytest.approx(float(hidden), rel=0.1)
    # of the joint that was wrong, on trajectories that no fit has seen
    *_, row = re.findall(r"joint2 \(joint 2\): (.*) → (.*) N m$", told, re.MULTILINE)
    assert float(row[1]) < 0.5 * float(row[0])
    assert "</html>" in page.read_text("utf-8") and str(page) in told


def test_a_program_gets_what_was_found(small, tmp_path, run):
    pytest.importorskip("jinja2", reason="needs skidyn[report]")
    code, told = run("demo", "--html", tmp_path / "demo.html")
    assert code == cli.DONE and told["found"] == ["spring"]
    assert told["after"][1] < 0.5 * told["before"][1]
