# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn payload``."""

from __future__ import annotations

from importlib.resources import files

import pytest

from skidyn import cli
from skidyn.datasets import load_ur5, make_hidden_effect_log


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    pytest.importorskip("pandas", reason="needs skidyn[io]")
    folder = tmp_path_factory.mktemp("payload")
    urdf = files("skidyn.datasets").joinpath("robots", "ur5.urdf").read_text("utf-8")
    (folder / "robot.urdf").write_text(urdf, encoding="utf-8")
    log = make_hidden_effect_log(
        load_ur5(), "payload", n_trajectories=4, duration=8.0, random_state=3
    )
    carries = log.frame["trajectory"].isin(log.parameters["trajectories"])
    frame = log.frame.drop(columns=[c for c in log.frame if c.startswith("ddq")])
    frame[carries].to_csv(folder / "loaded.csv", index=False)
    frame[~carries].to_csv(folder / "free.csv", index=False)
    currents = {f"tau{j}": f"i{j}" for j in range(1, 7)}
    for name, part in (("loaded", carries), ("free", ~carries)):
        part = frame[part].rename(columns=currents)
        part[list(currents.values())] /= 10.0
        part.to_csv(folder / f"{name}_current.csv", index=False)
    return folder, log.parameters["mass"]


def test_the_payload(runs, run, tmp_path):
    folder, mass = runs
    out = tmp_path / "payload.json"
    words = ("payload", folder / "loaded.csv", "--unloaded", folder / "free.csv")
    code, answer = run(*words, "--urdf", folder / "robot.urdf", "--out", out)
    assert code == cli.DONE and out.exists()
    assert answer["mass"] == pytest.approx(mass, rel=0.05)
    assert "scale alike" in answer["text"]
    assert answer["checks"] == {"loaded": [], "unloaded": []}


@pytest.mark.slow
def test_drive_gains(runs, run):
    folder, mass = runs
    words = ("payload", folder / "loaded_current.csv", "--unloaded", folder / "free_current.csv")
    code, answer = run(*words, "--urdf", folder / "robot.urdf", "--known-mass", mass)
    assert code == cli.DONE
    assert answer["gains"][1] == pytest.approx(10.0, rel=0.05)
    assert answer["checks"] == {"loaded": [], "unloaded": []}  # currents are as expected


@pytest.mark.slow
def test_a_mistake_in_currents_heads_the_gains(runs, capsys, tmp_path):
    pandas = pytest.importorskip("pandas", reason="needs skidyn[io]")
    folder, mass = runs
    frame = pandas.read_csv(folder / "free_current.csv")
    frame["i2"] = -frame["i2"]
    frame.to_csv(tmp_path / "flipped.csv", index=False)
    words = ["payload", folder / "loaded_current.csv", "--unloaded", tmp_path / "flipped.csv"]
    words += ["--urdf", folder / "robot.urdf", "--known-mass", mass]
    assert cli.main([*map(str, words)]) == cli.DONE
    out = capsys.readouterr().out
    assert out.startswith("Check the recordings without it first:")
    assert "fix it with: --flip tau2" in out


@pytest.mark.slow
def test_a_link_that_is_not_there(runs, capsys):
    folder, _ = runs
    words = ["payload", folder / "loaded.csv", "--unloaded", folder / "free.csv"]
    words += ["--urdf", folder / "robot.urdf", "--link", "gripper"]
    assert cli.main([*map(str, words)]) == cli.BAD_INPUT
    assert "no link 'gripper'" in capsys.readouterr().err
