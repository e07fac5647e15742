# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn diagnose``."""

from __future__ import annotations

from skidyn import cli
from skidyn.diagnosis import Diagnosis


def test_findings_are_judged_by_simulation_where_it_is_asked_for(work, run, monkeypatch):
    judged = []
    given = Diagnosis.judge_by_simulation
    monkeypatch.setattr(
        Diagnosis, "judge_by_simulation", lambda self: judged.append(given(self)) or judged[-1]
    )
    words = ("diagnose", work / "log.csv", "--urdf", work / "arm.urdf", "--effects", "maxwell_slip")

    code, report = run(*words, "--simulate")

    assert code == cli.DONE
    assert len(judged) == 1 and len(judged[0]) == len(report["effects"]) == 1
    assert not [note for note in report["warnings"] if "worsens the simulated" in note]
