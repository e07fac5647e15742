# SPDX-License-Identifier: BSD-3-Clause
"""The saved script repeats the clicks exactly, however the log was read."""

from __future__ import annotations

import warnings
from importlib.resources import files

import numpy as np
import pytest

import skidyn.explorer
from skidyn import cli
from skidyn.datasets import load_planar_arm
from skidyn.effects import Term, get_effect
from skidyn.explorer import Session
from skidyn.identification import RBDRegressor
from skidyn.simulation import servo_torque

pandas = pytest.importorskip("pandas", reason="needs skidyn[io]")


@pytest.fixture
def arm(tmp_path):
    text = files("skidyn.datasets").joinpath("robots", "planar_arm.urdf").read_text("utf-8")
    (tmp_path / "arm.urdf").write_text(text, encoding="utf-8")
    return tmp_path / "arm.urdf"


def odd_units(frame, path):
    """Degrees, milliseconds and currents under other names."""
    odd = pandas.DataFrame({"stamp": 1000 * frame["time"], "run": frame["trajectory"]})
    for j, name in ((1, "a"), (2, "b")):
        odd[f"pos_{name}"] = np.rad2deg(frame[f"q{j}"])
        odd[f"vel_{name}"] = np.rad2deg(frame[f"dq{j}"])
        odd[f"amp_{name}"] = frame[f"tau{j}"] / (5.0 * j)
    odd.to_csv(path, index=False)
    columns = (
        '{"time": "stamp", "trajectory": "run", "q": ["pos_a", "pos_b"],'
        ' "dq": ["vel_a", "vel_b"], "i": ["amp_a", "amp_b"]}'
    )
    return [
        *("--columns", columns, "--units", '{"q": "deg", "dq": "deg/s", "time": "ms"}'),
        *(
            "--drive-gains",
            "[5, 10]",
            "--joints",
            "joint1, joint2",
            "--model",
            "rigid_body,coulomb",
        ),
    ]


def no_time(frame, path):
    """A log without a clock."""
    frame.drop(columns="time").to_csv(path, index=False)
    return ["--rate", str(round(1 / frame["time"].diff().median(), 3)), "--nominal"]


def on_a_wall(frame, path):
    """A robot whose model has other stated bodies and another gravity than its description."""
    frame.to_csv(path, index=False)
    return ["--gravity=-9.81,0,0", "--nominal"]


@pytest.mark.parametrize(
    "write", [odd_units, no_time, pytest.param(on_a_wall, marks=pytest.mark.slow)]
)
def test_the_script_gives_the_numbers_of_the_page(write, arm, log, tmp_path, monkeypatch, capsys):
    options = write(log.frame, tmp_path / "log.csv")
    served = {}

    def serve(session, folder, *, checks, port, ready, **words):
        served["session"], served["words"] = session, words

    monkeypatch.setattr(skidyn.explorer, "serve", serve)
    monkeypatch.chdir(tmp_path)  # the script is run elsewhere
    words = ["explore", "log.csv", "--urdf", "arm.urdf", "--folder", str(tmp_path), *options]
    assert cli.main(words) == cli.DONE
    session = served["session"]
    plain = next(e for e in session.ranked(2) if not get_effect(e.kind).shapes).kind
    session.add(plain, joint=2)
    shaped = next(e for e in session.ranked(2) if get_effect(e.kind).shapes).kind
    session.add(shaped, joint=2, refined=False)
    session.refine()
    shown = session.history
    text = session.script(**served["words"])
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()

    monkeypatch.chdir(elsewhere)
    capsys.readouterr()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what is odd about the log was said before
        exec(compile(text, "explored.py", "exec"), {})

    printed = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [words[0] for words in printed] == ["as", plain, shaped]
    assert [[float(x) for x in words[-2:]] for words in printed] == [e["rmse"] for e in shown]
    assert (elsewhere / "model.skops").is_file()


def test_the_model_is_written_as_it_was_given(log):
    term = Term("stribeck", (2,), {"vs": np.float64(0.1)})
    model = RBDRegressor(load_planar_arm(), ["viscous", term], consistent=True)
    session = Session(model, log.X, log.y)
    session.add("spring", joint=2)

    text = session.script(["a.csv"], "r.urdf", reading={"rate": None})

    compile(text, "explored.py", "exec")
    assert "['viscous', Term('stribeck', (2,), {'vs': 0.1})], consistent=True)" in text
    assert "from skidyn.effects import Term" in text
    assert "read_log(['a.csv'], robot=robot)" in text
    assert "session.add('spring', joint=2)" in text


def test_the_script_of_servos_computes_their_torque(sticky_servo, arm, tmp_path, capsys):
    sticky_servo.log.to_csv(tmp_path / "servos.csv", index=False)
    model = RBDRegressor(sticky_servo.robot, ["viscous", "coulomb"])
    servo = sticky_servo.controller.checked(2)
    session = Session(model, sticky_servo.log, servo_torque(servo, sticky_servo.log))
    text = session.script([str(tmp_path / "servos.csv")], str(arm), controller=servo)
    assert "limit=[np.inf, np.inf]" in text and "needs_torque=False" in text
    text = text.replace('"model.skops"', repr(str(tmp_path / "model.skops")))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        exec(compile(text, "explored.py", "exec"), {})
    printed = [float(x) for x in capsys.readouterr().out.split()[-2:]]
    assert printed == pytest.approx(session.history[0]["rmse"], rel=1e-6)
