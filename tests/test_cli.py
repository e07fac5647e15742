# SPDX-License-Identifier: BSD-3-Clause
"""The command line, as a user or a script runs it."""

import json
import shutil
import signal
import subprocess
import sys
from contextlib import redirect_stdout

import numpy as np
import pytest

pandas = pytest.importorskip("pandas", reason="needs skidyn[io]")
pytest.importorskip("jinja2", reason="needs skidyn[report]")

from skidyn import cli  # noqa: E402
from skidyn._commands import COMMANDS  # noqa: E402
from skidyn._commands._identify import ESTIMATORS  # noqa: E402
from skidyn.datasets import load_planar_arm, make_hidden_effect_log  # noqa: E402


@pytest.fixture(scope="module")
def work(tmp_path_factory):
    """A folder with a robot and a log that hides Stribeck friction on joint 2, diagnosed."""
    from importlib.resources import files

    folder = tmp_path_factory.mktemp("cli")
    urdf = files("skidyn.datasets").joinpath("robots", "planar_arm.urdf").read_text("utf-8")
    (folder / "arm.urdf").write_text(urdf, encoding="utf-8")
    log = make_hidden_effect_log(load_planar_arm(), "stribeck", joints=[2], n_trajectories=6)
    log.frame.to_csv(folder / "log.csv", index=False)
    code = cli.main(
        ["diagnose", *arguments(folder), "--out", str(folder / "report.json"),
         "--html", str(folder / "report.html")]
    )  # fmt: skip
    assert code == cli.DONE
    return folder


def arguments(folder):
    return [str(folder / "log.csv"), "--urdf", str(folder / "arm.urdf")]


def run_json(capsys, *words):
    code = cli.main([*map(str, words), "--json"])
    return code, json.loads(capsys.readouterr().out)


def test_diagnose_writes_report_and_page(work):
    report = json.loads((work / "report.json").read_text("utf-8"))
    assert report["schema"] == "skidyn.diagnosis/1"
    assert report["verdict"] == "missing"
    assert [(e["kind"], e["joints"]) for e in report["effects"]] == [("stribeck", [2])]
    assert set(report["provenance"]["sha256"]) == {str(work / "log.csv"), str(work / "arm.urdf")}
    assert "executable" not in report["provenance"]["versions"]
    assert "</html>" in (work / "report.html").read_text("utf-8")


def test_add_lowers_the_error_of_the_joint(work, capsys):
    out = work / "better.json"
    code, errors = run_json(
        capsys, "add", "--from", work / "report.json", "--effect", "stribeck", "--joints", "2",
        "--out", out,
    )  # fmt: skip
    assert code == cli.DONE
    assert errors["after"][1] < 0.5 * errors["before"][1]
    effects = json.loads(out.read_text("utf-8"))["effects"]
    assert ("stribeck", [2]) in [(e["kind"], e["joints"]) for e in effects]


def test_a_log_that_changed_since_the_report_is_reported(work, tmp_path, capsys):
    report = json.loads((work / "report.json").read_text("utf-8"))
    report["provenance"]["sha256"] = dict.fromkeys(report["provenance"]["sha256"], "0")
    (tmp_path / "old.json").write_text(json.dumps(report), encoding="utf-8")
    words = ["add", "--from", str(tmp_path / "old.json"), "--effect", "spring", "--joints", "1"]
    assert cli.main(words) == cli.DONE
    assert "log.csv has changed since" in capsys.readouterr().err


def test_report_makes_the_page_anew(work, capsys):
    page = work / "again.html"
    code, content = run_json(capsys, "report", "--from", work / "report.json", "--html", page)
    assert (code, content) == (cli.DONE, {"html": str(page)})
    assert "Stribeck" in page.read_text("utf-8")


def test_compare_knows_joints_trajectories_and_regimes(work, capsys):
    code, content = run_json(capsys, "compare", *arguments(work))
    assert code == cli.DONE
    assert {(row["joint"], row["trajectory"]) for row in content["table"]} == {
        (j, t) for j in (1, 2) for t in range(1, 7)
    }
    assert cli.main(["compare", *arguments(work)]) == cli.DONE
    assert "reversal" in capsys.readouterr().out


def test_identify_writes_parameters(work, capsys):
    out = work / "parameters.json"
    code, content = run_json(capsys, "identify", *arguments(work), "--out", out)
    assert code == cli.DONE
    assert content == json.loads(out.read_text("utf-8"))
    assert np.shape(content["inertial_parameters"]) == (2, 10)
    assert {e["kind"] for e in content["effects"]} == {"viscous", "coulomb"}
    assert content["condition_number"] > 1 and content["open_combinations"] == []


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_identify_by_any_estimator_and_only_what_is_essential(work, capsys, estimator):
    words = ["identify", *arguments(work), "--estimator", estimator, "--consistent"]
    assert cli.main([*words, "--essential"]) == cli.DONE
    out = capsys.readouterr().out
    assert "condition number of the excitation" in out and "others left out" in out


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_simulate_writes_a_log(tmp_path, capsys, suffix):
    out = tmp_path / f"log.{suffix}"
    code, truth = run_json(
        capsys, "simulate", "--robot", "planar_arm", "--effect", "spring", "--joints", "1",
        "--out", out,
    )  # fmt: skip
    assert (code, truth["effect"], truth["joints"]) == (cli.DONE, "spring", [1])
    frame = (pandas.read_csv if suffix == "csv" else pandas.read_parquet)(out)
    assert {"time", "trajectory", "q2", "dq1", "tau2"} <= set(frame.columns)
    assert [path.name for path in tmp_path.iterdir()] == [out.name]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["diagnose", "none.csv", "--urdf", "none.urdf"], "no file none.urdf"),
        (["simulate", "--out", "log.xls"], "must end in .csv or .parquet"),
        (["simulate", "--robot", "r2d2", "--out", "log.csv"], "no embedded robot 'r2d2'"),
        (["simulate", "--effect", "dahll", "--out", "log.csv"], "Did you mean 'dahl'"),
        (["simulate", "--joints", "a,b", "--out", "log.csv"], "joints are numbers from 1"),
        (["add", "--from", "none.json", "--effect", "dahl"], "none.json"),
    ],
)
def test_wrong_input_is_one_line_and_an_exit_code(words, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(words) == cli.BAD_INPUT
    caught = capsys.readouterr()
    assert message in caught.err
    assert "Traceback" not in caught.err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("text", ["not json", "[]", "{}", '{"provenance": 3}'])
def test_a_file_that_is_no_report_is_refused(tmp_path, capsys, text):
    (tmp_path / "x.json").write_text(text, encoding="utf-8")
    words = ["report", "--from", str(tmp_path / "x.json"), "--html", str(tmp_path / "x.html")]
    assert cli.main(words) == cli.BAD_INPUT
    assert "x.json" in capsys.readouterr().err
    assert not (tmp_path / "x.html").exists()


def test_the_model_must_have_a_rigid_body(work, capsys):
    assert cli.main(["compare", *arguments(work), "--model", "viscous"]) == cli.BAD_INPUT
    assert "must contain rigid_body" in capsys.readouterr().err


def test_an_interrupted_run_leaves_the_previous_output_whole(work, tmp_path, monkeypatch, capsys):
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


def test_effects_lists_the_catalogue(capsys):
    code, content = run_json(capsys, "effects")
    assert code == cli.DONE
    assert content["dahl"]["title"]


def test_without_a_command_it_teaches(capsys):
    assert cli.main([]) == cli.BAD_INPUT
    assert "diagnose" in capsys.readouterr().out


def test_runs_as_a_module():
    done = subprocess.run(
        [sys.executable, "-m", "skidyn", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("skidyn ")


def test_a_reader_that_stops_early_is_no_error():
    words = [sys.executable, "-m", "skidyn", "effects", "--json"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        errors = process.stderr.read()
    assert (process.returncode, errors) == (cli.DONE, b"")


def test_currents_become_torques_by_drive_gains(work, tmp_path, capsys):
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=4.0)
    frame = log.frame.rename(columns={"tau1": "i1", "tau2": "i2"})
    frame[["i1", "i2"]] = frame[["i1", "i2"]] / [10.0, 5.0]
    frame.to_csv(tmp_path / "currents.csv", index=False)
    words = ["compare", str(tmp_path / "currents.csv"), "--urdf", str(work / "arm.urdf")]
    code, result = run_json(capsys, *words, "--drive-gains", "[10, 5]")
    assert code == cli.DONE
    assert max(row["relative"] for row in result["table"]) < 0.5


def test_every_command_teaches_with_an_example(capsys):
    for command in COMMANDS:
        name = command.__name__.rpartition("_")[2]
        with pytest.raises(SystemExit) as stopped:
            cli.main([name, "--help"])
        text = capsys.readouterr().out
        assert stopped.value.code == 0
        assert f"  skidyn {name}" in text


def test_check_judges_a_log_without_and_with_a_robot(work, capsys):
    log, urdf = arguments(work)[0], arguments(work)[-1]
    assert cli.main(["check", log]) == cli.DONE
    assert "at limit" in capsys.readouterr().out
    code, quality = run_json(capsys, "check", log, "--urdf", urdf)
    assert code == cli.DONE
    assert quality["gaps"] == 0 and quality["joints"][0]["name"] == "joint1"


@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_completion_knows_the_commands(shell, capsys):
    pytest.importorskip("shtab")
    assert cli.main(["completion", shell]) == cli.DONE
    script = capsys.readouterr().out
    assert "diagnose" in script and "--drive-gains" in script
    code, told = run_json(capsys, "completion", shell)
    assert code == cli.DONE and told["script"] == script.removesuffix("\n")


def test_every_option_with_choices_is_completed(tmp_path):
    """A real bash is asked for what may follow."""
    pytest.importorskip("shtab")
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("bash is not installed")
    script = tmp_path / "skidyn.bash"
    with script.open("w") as file, redirect_stdout(file):
        assert cli.main(["completion", "bash"]) == cli.DONE
    wanted = {
        "check --clock": {"recorded", "regular"},
        "diagnose --torque-sign": {"recorded", "command"},
        "export --format": {"c", "python", "onnx", "urdf", "mjcf", "usd", "bam", "ros2"},
        "simulate --robot": {"panda", "scara", "ur5"},
        "simulate --engine": {"own", "mujoco"},
        "add --effect": {"dahl", "spring"},
        "excite --criterion": {"determinant", "condition"},
        "identify --estimator": {"robust", "ridge"},
        "completion": {"bash", "zsh", "tcsh"},
    }
    for words, expected in wanted.items():
        line = ["skidyn", *words.split(), ""]
        typed = " ".join(f"'{word}'" for word in line)
        ask = (
            f"source {script}; COMP_WORDS=({typed}); COMP_CWORD={len(line) - 1}; "
            '_shtab_skidyn; printf "%s\\n" "${COMPREPLY[@]}"'
        )
        answer = subprocess.run([bash, "-c", ask], capture_output=True, text=True, check=True)
        assert expected <= set(answer.stdout.split()), words


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is another thing there")
def test_ctrl_c_leaves_no_half_written_file(work, tmp_path):
    """A real signal to a real process, while it works."""
    out, page = tmp_path / "report.json", tmp_path / "report.html"
    words = ["diagnose", *arguments(work), "--out", str(out), "--html", str(page)]
    process = subprocess.Popen(
        [sys.executable, "-c", STOPPABLE, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    process.stdout.readline()  # the report is written beside its place, and not yet put there
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=120)
    assert (process.returncode, errors.decode().splitlines()[-1]) == (
        cli.STOPPED,
        "stopped; no file was left half written",
    )
    assert list(tmp_path.iterdir()) == []


STOPPABLE = """
import os, signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # a background shell ignores it
from skidyn.cli import main

def slow(*paths):
    print("now", flush=True)
    time.sleep(60)

os.replace = slow
sys.exit(main(sys.argv[1:]))
"""


def test_simulate_runs_a_fitted_model_along_a_log(capsys, tmp_path):
    pytest.importorskip("skops")
    from skidyn import save_model
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
