# SPDX-License-Identifier: BSD-3-Clause
"""Work tells how far it is."""

from __future__ import annotations

import sys
from importlib.resources import files

import pytest

from skidyn import cli
from skidyn.datasets import load_planar_arm, make_hidden_effect_log

pytest.importorskip("pandas")


def test_steps_of_a_diagnosis_are_known_while_it_runs(saved, tmp_path, monkeypatch):
    progress = pytest.importorskip("rich.progress", reason="needs skidyn[progress]").Progress
    log = make_hidden_effect_log(load_planar_arm(), "stribeck", joints=[2], n_trajectories=3)
    text = files("skidyn.datasets").joinpath("robots", "planar_arm.urdf").read_text("utf-8")
    (tmp_path / "arm.urdf").write_text(text, encoding="utf-8")
    told = []

    def update(self, task, *, description, total, completed):
        told.append((description, total, completed))

    monkeypatch.setattr(progress, "update", update)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    words = ["diagnose", str(saved(log.frame)), "--urdf", str(tmp_path / "arm.urdf")]
    assert cli.main([*words, "--no-cache", "--jobs", "1"]) == cli.DONE

    assert all(total == 1.0 and 0 <= completed <= 1 for _, total, completed in told)
    stages = list(dict.fromkeys(text for text, _, _ in told))
    at = stages.index("Computing the rigid body")
    assert stages[at : at + 3] == ["Computing the rigid body", "Fitting", "Preparing effects"]
    assert {"Round 1: refining the best", "Round 2: screening effects"} <= set(stages)
    assert stages[-1] == "Judging what was found"
