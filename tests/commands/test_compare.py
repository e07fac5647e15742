# SPDX-License-Identifier: BSD-3-Clause
import json

import pytest

pandas = pytest.importorskip("pandas", reason="needs skidyn[io]")
pytest.importorskip("jinja2", reason="needs skidyn[report]")

from skidyn import cli, load_model, save_model  # noqa: E402
from skidyn.identification import RBDRegressor  # noqa: E402
from skidyn.robots import Robot  # noqa: E402

LOG = ("log.csv", "--urdf", "arm.urdf")


@pytest.fixture
def here(work, monkeypatch):
    monkeypatch.chdir(work)
    return work


@pytest.mark.slow
def test_two_models_of_one_log(here, run, tmp_path):
    model = save_model(
        tmp_path / "m.skops", RBDRegressor(Robot.from_urdf("arm.urdf"), ("viscous",))
    )
    assert load_model(model).effects == ("viscous",)
    page = tmp_path / "models.html"
    code, report = run(
        "compare", *LOG, "--against-model", model, "--names", "usual,poor", "--html", page
    )
    assert code == cli.DONE
    assert report == json.loads(page.with_suffix(".json").read_text("utf-8"))
    assert report["same_log"] and report["names"] == ["usual", "poor"]
    usual, poor = (side["rmse_before"] for side in report["sides"])
    assert all(a < b for a, b in zip(usual, poor, strict=True))
    assert {f["joint"] for f in report["findings"] if f["in"] == ["poor"]} == {1}


def test_a_page_and_its_numbers_are_written_together(here, capsys, tmp_path):
    (tmp_path / "page.json").mkdir()
    words = ["compare", *LOG, "--against", "log.csv", "--html", str(tmp_path / "page.html")]
    assert cli.main(words) == cli.BAD_INPUT
    assert "page.json is not a regular file" in capsys.readouterr().err
    assert [f.name for f in tmp_path.iterdir()] == ["page.json"]


def test_two_reports(here, capsys, tmp_path):
    for name, joint in (("a", 1), ("b", 2)):
        frame = pandas.read_csv("log.csv")
        frame = frame[frame["trajectory"] <= 3]
        frame[f"tau{joint}"] *= 1.1
        frame.to_csv(tmp_path / f"{name}.csv", index=False)
        words = [str(tmp_path / f"{name}.csv"), *LOG[1:], "--effects", "offset"]
        assert cli.main(["diagnose", *words, "--out", str(tmp_path / f"{name}.json")]) == cli.DONE
    capsys.readouterr()
    assert cli.main(["compare", str(tmp_path / "a.json"), str(tmp_path / "b.json")]) == cli.DONE
    told = capsys.readouterr().out
    assert "A is a, B is b" in told and "two different recordings" in told


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["log.csv"], "--urdf is missing"),
        (["a.json"], "two reports"),
        ([*LOG, "--html", "x.html"], "compare two"),
    ],
)
def test_what_is_missing_is_said(here, capsys, words, complaint):
    assert cli.main(["compare", *words]) == cli.BAD_INPUT
    assert complaint in capsys.readouterr().err


def test_traces_of_one_log(here, capsys, tmp_path):
    pytest.importorskip("mcap_ros2", reason="needs skidyn[io]")
    file = tmp_path / "errors.mcap"
    assert cli.main(["compare", *LOG, "--traces", str(file)]) == cli.DONE
    assert str(file) in capsys.readouterr().out
    assert file.read_bytes().startswith(b"\x89MCAP0")
    words = ["compare", *LOG, "--against", "log.csv", "--traces", str(file)]
    assert cli.main(words) == cli.BAD_INPUT
    assert "--traces writes one model" in capsys.readouterr().err


def test_compare_knows_joints_trajectories_and_regimes(capsys, run, arguments):
    code, content = run("compare", *arguments)
    assert code == cli.DONE
    assert {(row["joint"], row["trajectory"]) for row in content["table"]} == {
        (j, t) for j in (1, 2) for t in range(1, 7)
    }
    assert cli.main(["compare", *arguments]) == cli.DONE
    assert "reversal" in capsys.readouterr().out
    assert cli.main(["compare", *arguments, "--gain", "tau=30000"]) == cli.DONE
    heads, *rows = capsys.readouterr().out.partition("joint and regime")[2].splitlines()[1:4]
    assert [len(row.split()) for row in rows] == [1 + len(heads.split())] * 2


@pytest.mark.slow
def test_traces_hold_a_recording_that_is_in_the_log_twice_once(here, capsys, tmp_path):
    pytest.importorskip("mcap_ros2", reason="needs skidyn[io]")
    frame = pandas.read_csv("log.csv")
    again = frame[frame["trajectory"] == frame["trajectory"].min()]
    again = again.assign(trajectory=99, time=again["time"] + 1000.0)
    pandas.concat([frame, again]).to_csv(tmp_path / "twice.csv", index=False)
    file = tmp_path / "errors.mcap"
    words = ["compare", str(tmp_path / "twice.csv"), *LOG[1:], "--traces", str(file)]
    assert cli.main(words) == cli.DONE
    assert "occur twice in the log" in capsys.readouterr().out and file.exists()
