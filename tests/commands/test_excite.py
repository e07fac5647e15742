# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn excite``."""

from __future__ import annotations

import pandas as pd
import pytest

from skidyn import cli
from skidyn.datasets import load_planar_arm


def test_a_motion_within_the_limits_is_written(work, run, tmp_path):
    out = tmp_path / "motion.csv"

    code, answer = run(
        "excite", "--urdf", work / "arm.urdf", "--duration", 4, "--sampling", 50, "--out", out
    )

    table = pd.read_csv(out)
    limits = load_planar_arm().velocity_limits
    assert code == cli.DONE
    assert answer["condition_number"] > 1
    assert len(table) == 201
    assert (table[["dq1", "dq2"]].abs().max().to_numpy() <= limits).all()


def test_a_motion_too_short_to_start_and_stop_is_refused(work, tmp_path, capsys):
    out = tmp_path / "motion.csv"
    words = ["excite", "--urdf", str(work / "arm.urdf"), "--duration", "0.5", "--out", str(out)]

    assert cli.main(words) == cli.BAD_INPUT
    assert "is too short" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.slow
def test_the_next_motion_adds_to_the_recordings(work, run, tmp_path):
    words = ["excite", "--urdf", work / "arm.urdf", "--duration", 4, "--motion", "quintic"]
    limits = ("--limits", '{"torque": [14, 3]}')

    _, first = run(*words, *limits, "--out", tmp_path / "first.csv")
    code, after = run(
        *words, *limits, "--recorded", work / "log.csv", "--out", tmp_path / "next.csv"
    )

    assert code == cli.DONE
    assert after["condition_number"] != first["condition_number"]
    motion = pd.read_csv(tmp_path / "next.csv")
    assert not motion.equals(pd.read_csv(tmp_path / "first.csv"))


def test_unknown_limits_are_refused_by_name(work, tmp_path, capsys):
    words = ["excite", "--urdf", str(work / "arm.urdf"), "--out", str(tmp_path / "m.csv")]

    assert cli.main([*words, "--limits", '{"speed": [1, 1]}']) == cli.BAD_INPUT
    assert "position, velocity, acceleration, torque, workspace" in capsys.readouterr().err
