# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn check``."""

import json
from pathlib import Path

import numpy as np
import pytest

from skidyn import cli, datasets
from skidyn.cli import main
from skidyn.datasets import load_planar_arm, make_hidden_effect_log


def test_check_judges_a_log_without_and_with_a_robot(capsys, run, arguments):
    log, urdf = arguments[0], arguments[-1]
    assert cli.main(["check", log]) == cli.DONE
    assert "at limit" in capsys.readouterr().out
    code, quality = run("check", log, "--urdf", urdf)
    assert code == cli.DONE
    assert quality["gaps"] == 0 and quality["joints"][0]["name"] == "joint1"


URDF = str(Path(datasets.__file__).parent / "robots" / "planar_arm.urdf")
LOG = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=4.0).frame


@pytest.fixture
def flipped(tmp_path):
    path = tmp_path / "log.csv"
    LOG.assign(dq2=-LOG["dq2"]).to_csv(path, index=False)
    return str(path)


def test_check_says_what_matters_below_the_table_with_the_command_that_fixes_it(flipped, capsys):
    assert main(["check", flipped]) == 0
    table, told = capsys.readouterr().out.split("\n\n!! ")
    assert table.startswith(f"{len(LOG)} samples")
    assert told.startswith("the velocity of") and "--flip dq2" in told
    assert f"skidyn check {flipped} --flip dq2" in told
    assert main(["check", flipped, "--flip", "dq2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["checks"] == []


def test_the_command_that_fixes_a_log_keeps_its_options(tmp_path, capsys):
    path = tmp_path / "log.csv"
    motion = {name: 57.29578 * LOG[name] for name in ("q1", "q2", "dq1", "dq2")}
    LOG.assign(**motion, time=1e3 * LOG["time"]).to_csv(path, index=False)
    assert main(["check", str(path), "--urdf", URDF, "--units", "time=ms"]) == 0
    mended = f"skidyn check {path} --urdf {URDF} --units time=ms,q=deg,dq=deg/s"
    assert mended in capsys.readouterr().out


@pytest.mark.parametrize(
    "option, words",
    [
        (["--flip", "elbow"], "flip: 'elbow' is neither"),
        (["--zero", "q1"], "'q1' is not NAME=VALUE"),
        (["--gain", "tau1=much"], "'much' is not a number"),
        (["--late", "tau=0.01+much*t"], "or one that grows such as 0.013+0.0005*t"),
        (["--combine", "tau1=tau1+volts"], "the log has no signal volts"),
        (["--gain", "tau1=0.01*t"], "'0.01*t' is not a number"),
        (["--order", "tau=1"], "is not an order of 2 joints"),
        (["--order", "2,1,tau=2,1"], "'2,1' belongs to no quantity"),
        (["--resample", "0"], "resample_rate is 0.0; expected a rate in Hz above zero"),
        (["--lowpass", "tau=-1"], "expected a signal and the positive time constant"),
    ],
)
def test_an_option_that_cannot_be_met_is_refused(flipped, capsys, option, words):
    assert main(["check", flipped, *option]) == 2
    assert words in capsys.readouterr().err


def test_an_option_that_several_checks_ask_for_is_given_once(tmp_path, capsys):
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=4.0).frame
    held = np.arange(len(log))
    for rows in log.groupby("trajectory").groups.values():
        for start in (140, 375):
            held[rows[start] : rows[start] + 25] = rows[start]
    signals = [name for name in log if name not in ("time", "trajectory")]
    log[signals] = log[signals].to_numpy()[held]
    log.to_csv(tmp_path / "log.csv", index=False)
    assert main(["check", str(tmp_path / "log.csv")]) == 0
    told = capsys.readouterr().out
    assert told.count("fix it with: --drop-repeated") > 1
    assert told.splitlines()[-1].count("--drop-repeated") == 1


def test_rows_that_are_left_out_are_counted(tmp_path, capsys):
    holes = LOG.copy()
    holes.loc[[5, 6], "tau1"] = float("nan")
    holes.loc[9, "time"] = holes.loc[8, "time"]
    holes.to_csv(tmp_path / "log.csv", index=False)
    assert main(["check", str(tmp_path / "log.csv")]) == 2
    assert "leave these rows out with --missing drop" in capsys.readouterr().err
    assert main(["check", str(tmp_path / "log.csv"), "--missing", "drop"]) == 0
    told = capsys.readouterr().out
    assert f"note: missing: 2 of {len(LOG)} rows with NaN or infinite values were left out" in told
    assert "1 of 1198 rows repeat the time of the previous row" in told


def test_failed_reads_are_told_with_an_option_that_leaves_them_out(tmp_path, capsys):
    failed = LOG.copy()
    failed.loc[10:400:13, ["q1", "q2", "tau1"]] = -1.0
    failed.loc[500:900:13, "dq1"] = 9999.0
    failed.to_csv(tmp_path / "log.csv", index=False)
    words = ["check", str(tmp_path / "log.csv")]
    assert main(words) == 0
    told = capsys.readouterr().out
    assert "--placeholder q=-1,tau1=-1,dq1=9999" in told
    assert main([*words, "--placeholder", "9999,q=-1,tau1=-1"]) == 0
    told = capsys.readouterr().out
    assert f"note: placeholder: 31 of {len(LOG)} rows hold all=9999" in told
    assert "stands for failed reads" not in told
    assert main([*words, "--placeholder", "q=-2"]) == 2
    assert "no value of q equals -2" in capsys.readouterr().err


def test_a_file_without_a_header_is_read_by_positions(tmp_path, capsys):
    path = str(tmp_path / "log.csv")
    LOG.drop(columns="trajectory").to_csv(path, index=False, header=False)
    assert main(["check", path]) == 2
    assert "--columns time=0,q=1-6" in capsys.readouterr().err
    assert main(["check", path, "--columns", "time=0,q=1-2,dq=3-4,tau=5-6"]) == 0


def test_topics_are_chosen_by_name(tmp_path, capsys):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        for group in ("left", "right"):
            for name in LOG:
                file[f"{group}/{name}"] = LOG[name][:400]
            file[f"{group}/other_{group}"] = LOG["q1"][:400]
    words = ["check", str(tmp_path / "log.h5")]
    assert main(words) == 2
    assert "--topics" in capsys.readouterr().err
    assert main([*words, "--topics", "left"]) == 0


def test_what_one_check_after_another_found_is_taken_together(flipped, capsys):
    words = ["--gain", "tau1=2,tau1=0.5", "--late", "tau=0.01,tau=-0.01"]
    assert main(["check", flipped, "--order", "q=1,2,tau=1,2", *words]) == 0
    told = capsys.readouterr()
    assert "gain: tau1 was multiplied by 1 in" in told.out + told.err


@pytest.mark.parametrize(
    "text", ["tau=0.01+5e-4*t", "tau=0.01,tau=0.0005*t", '{"tau": [0.01, 5e-4]}']
)
def test_a_delay_may_grow_with_the_time(text, flipped, capsys):
    assert main(["check", flipped, "--late", text]) == 0
    told = capsys.readouterr()
    assert "late: tau by 10 ms and 0.5 ms more per second removed" in told.out + told.err


def test_gravity_of_another_length_than_three_is_refused(flipped, capsys):
    assert main(["check", flipped, "--urdf", URDF, "--gravity", "0,1"]) == 2
    assert "gravity" in capsys.readouterr().err


def test_gravity_that_was_removed_is_said_in_words(flipped, capsys):
    assert main(["check", flipped, "--urdf", URDF, "--gravity", "none"]) == 0
    told = capsys.readouterr()
    assert "gravity: (0, 0, 0)" in told.out + told.err
    assert main(["check", flipped, "--urdf", URDF, "--gravity", "0,0,0"]) == 2
    assert "'none'" in capsys.readouterr().err
