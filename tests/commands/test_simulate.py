# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn simulate``."""

import json

import pandas
import pytest

from skidyn import cli
from skidyn.datasets import load_planar_arm, make_hidden_effect_log


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_simulate_writes_a_log(tmp_path, suffix, run):
    out = tmp_path / f"log.{suffix}"
    code, truth = run(
        "simulate", "--robot", "planar_arm", "--effect", "spring", "--joints", "1",
        "--out", out,
    )  # fmt: skip
    assert (code, truth["effect"], truth["joints"]) == (cli.DONE, "spring", [1])
    frame = (pandas.read_csv if suffix == "csv" else pandas.read_parquet)(out)
    assert {"time", "trajectory", "q2", "dq1", "tau2"} <= set(frame.columns)
    assert [path.name for path in tmp_path.iterdir()] == [out.name]


def test_an_interrupted_run_leaves_the_previous_output_whole(tmp_path, monkeypatch):
    out = tmp_path / "log.csv"
    out.write_text("previous", encoding="utf-8")

    def interrupted(frame, path, **options):
        path.write_text("half", encoding="utf-8")
        raise KeyboardInterrupt

    monkeypatch.setattr(pandas.DataFrame, "to_csv", interrupted)
    words = ["simulate", "--robot", "planar_arm", "--out", str(out)]
    assert cli.main(words) == cli.STOPPED
    assert out.read_text("utf-8") == "previous"
    assert [path.name for path in tmp_path.iterdir()] == ["log.csv"]


def test_simulate_runs_a_fitted_model_along_a_log(capsys, tmp_path):
    pytest.importorskip("skops")
    from sklearn.linear_model import Ridge

    from skidyn import save_model
    from skidyn.hybrid import HybridRegressor
    from skidyn.identification import RBDRegressor

    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=3.0)
    model = RBDRegressor(log.robot).fit(log.X, log.y)
    save_model(tmp_path / "arm.skops", model)
    log.frame.to_csv(tmp_path / "run.csv", index=False)
    files = [str(tmp_path / name) for name in ("arm.skops", "run.csv")]
    words = ["simulate", "--model", files[0], "--log", files[1]]
    assert cli.main([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["joints"] == ["joint1", "joint2"] and max(told["position"]) < 0.05
    assert cli.main([*words, "--out", str(tmp_path / "motion.csv")]) == 0
    assert "simulation over 1 s" in capsys.readouterr().out
    assert "q1" in (tmp_path / "motion.csv").read_text().splitlines()[0]
    assert cli.main(words[:3]) == 2
    assert "--log is missing" in capsys.readouterr().err
    assert cli.main(["simulate", "--model", "nowhere", "--log", files[1]]) == 2
    assert "no file nowhere; --model must name a model" in capsys.readouterr().err
    save_model(tmp_path / "hybrid.skops", HybridRegressor(model, Ridge()).fit(log.X, log.y))
    assert cli.main(["simulate", "--model", str(tmp_path / "hybrid.skops"), *words[3:]]) == 2
    assert "HybridRegressor has no fitted robot" in capsys.readouterr().err


@pytest.mark.slow
def test_simulate_follows_the_commands_of_a_log_without_torque(capsys, tmp_path):
    pytest.importorskip("skops")
    from skidyn import save_model
    from skidyn.identification import RBDRegressor

    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=3.0)
    save_model(tmp_path / "arm.skops", RBDRegressor(log.robot).fit(log.X, log.y))
    frame = log.frame
    for j in (1, 2):  # a servo of 40 N m/rad and 2 N m s/rad
        own = frame[f"tau{j}"] + 2 * frame[f"dq{j}"]
        frame[f"q_ref{j}"] = frame[f"q{j}"] + own / 40
    frame.to_csv(tmp_path / "whole.csv", index=False)
    frame.drop(columns=["tau1", "tau2"]).to_csv(tmp_path / "run.csv", index=False)
    words = ["simulate", "--model", str(tmp_path / "arm.skops"), "--json", "--log"]
    given = '{"stiffness": 40, "damping": 2, "follows_velocity": false}'
    errors = []
    for name, controller in (("run", given), ("whole", "fit")):
        assert cli.main([*words, str(tmp_path / f"{name}.csv"), "--controller", controller]) == 0
        errors.append(json.loads(capsys.readouterr().out)["position"])
    assert max(errors[0]) < 0.01
    assert errors[1] == pytest.approx(errors[0], rel=0.05)
    assert cli.main([*words, str(tmp_path / "run.csv")]) == 2
    assert "lacks tau1" in capsys.readouterr().err
    assert cli.main([*words, str(tmp_path / "run.csv"), "--controller", "{}"]) == 2
    assert "expected fit, or stiffness" in capsys.readouterr().err
