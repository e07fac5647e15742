# SPDX-License-Identifier: BSD-3-Clause
"""The loop on recordings of real robots; skipped where they are absent."""

from __future__ import annotations

import runpy
import warnings
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "4_real_robots"


@pytest.fixture
def run(data_dir, monkeypatch):
    """Run an example and hand back its variables."""
    monkeypatch.setenv("SKIDYN_DATA", str(data_dir))
    monkeypatch.setenv("SKIDYN_SMALL", "1")

    def run_example(name):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the recordings' own faults are listed elsewhere
            return runpy.run_path(str(EXAMPLES / name))

    return run_example


def test_ur10e_effects_found_on_some_recordings_cut_the_error_of_others(run):
    result = run("plot_real_ur10e.py")

    kinds = {finding.kind for finding in result["diagnosis"].findings}
    assert "load_dependent_friction" in kinds
    assert "rotor_inertia" not in kinds
    assert {"dahl", "maxwell_slip", "lugre"} & kinds  # the reversals, which sliding rows leave out
    for part in ("from first to last motion", "while the joint moves"):
        assert result["RATIOS"]["50 s Fourier", part] < 0.70
        assert result["RATIOS"]["point to point", part] < 0.85
    assert [error.joint for error in result["REST"]] == [5, 6]
    assert all(error.beyond < 0.5 * error.rmse for error in result["REST"])


def test_payloads_that_come_and_that_are_not_there(run):
    result = run("plot_real_payload.py")

    payload, absent = result["PAYLOAD"], result["ABSENT"]
    assert payload.kind == "payload"
    assert payload.joints == (6,)
    assert abs(payload.parameters["mass"]["value"] - 2.805) < 0.15 * 2.805
    assert "cannot separate mass from drive gain" in payload.sentence
    assert absent.kind == "payload"
    assert absent.joints == (7,)
    assert -0.85 < absent.parameters["mass"]["value"] < -0.55
