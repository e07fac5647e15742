# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn add``."""

import json

import pytest

from skidyn import cli
from skidyn.datasets import load_planar_arm, make_hidden_effect_log

SERVO = '{"stiffness": [200, 12], "damping": [12, 0.6], "follows_velocity": false}'
MODEL = ("--model", "rigid_body,viscous,coulomb,rotor_inertia")


@pytest.fixture(scope="module")
def weak_servo(servo_log, work, tmp_path_factory):
    """A report of servos whose second one supplies 0.5 N m at most, which nobody was told."""
    pytest.importorskip("jinja2", reason="needs skidyn[report]")
    folder = tmp_path_factory.mktemp("weak")
    servo_log({}, limit=(100.0, 0.5)).log.to_csv(folder / "run.csv", index=False)
    words = ["diagnose", folder / "run.csv", "--urdf", work / "arm.urdf", "--controller", SERVO]
    written = ["--out", folder / "report.json", "--html", folder / "page.html"]
    assert cli.main([*map(str, (*words, *MODEL, *written))]) == cli.DONE
    return folder


def test_add_lowers_the_error_of_the_joint(diagnosed, run):
    out = diagnosed / "better.json"
    code, errors = run(
        "add", "--from", diagnosed / "report.json", "--effect", "stribeck", "--joints", "2",
        "--out", out,
    )  # fmt: skip
    assert code == cli.DONE
    assert errors["after"][1] < 0.5 * errors["before"][1]
    effects = json.loads(out.read_text("utf-8"))["effects"]
    assert ("stribeck", [2]) in [(e["kind"], e["joints"]) for e in effects]


def test_joints_that_get_worse_are_marked_and_the_file_is_named(diagnosed, tmp_path, capsys):
    out = tmp_path / "coupled.json"
    words = ["add", "--from", str(diagnosed / "report.json"), "--effect", "coupling_spring"]
    assert cli.main([*words, "--joints", "1,2", "--out", str(out)]) == cli.DONE
    *_, written = lines = capsys.readouterr().out.splitlines()
    assert written == f"written: {out}"
    changes = {line: float(line.split("(")[1].split("%")[0]) for line in lines[1:-1]}
    assert all(line.endswith("worse") == (change > 2) for line, change in changes.items())


@pytest.fixture(scope="module")
def loaded(work, tmp_path_factory):
    """A report of a log in which some recordings carry a load."""
    folder = tmp_path_factory.mktemp("loaded")
    log = make_hidden_effect_log(load_planar_arm(), "payload", duration=5.0, random_state=3)
    log.frame.to_csv(folder / "run.csv", index=False)
    words = ["diagnose", folder / "run.csv", "--urdf", work / "arm.urdf"]
    assert cli.main([*map(str, words), "--out", str(folder / "report.json")]) == cli.DONE
    return folder


@pytest.mark.slow
def test_what_acts_in_some_recordings_is_added_to_these(loaded, run):
    (effect,) = json.loads((loaded / "report.json").read_text("utf-8"))["effects"]
    assert effect["kind"] == "payload"
    assert effect["acts"] == {"trajectories": effect["trajectories"]}

    code, errors = run("add", "--from", loaded / "report.json", "--effect", "payload")

    assert code == cli.DONE
    assert errors["after"][1] < 0.8 * errors["before"][1]


def test_joints_on_which_a_report_has_no_limits_are_not_left_out(loaded, run):
    content = json.loads((loaded / "report.json").read_text("utf-8"))
    content["effects"] = [{"kind": "offset", "joints": [1], "acts": {"trajectories": [1]}}]
    (loaded / "one.json").write_text(json.dumps(content), encoding="utf-8")
    out = loaded / "offsets.json"
    words = ("--effect", "offset", "--joints", "1,2", "--out", out)
    assert run("add", "--from", loaded / "one.json", *words)[0] == cli.DONE
    added = json.loads(out.read_text("utf-8"))["effects"]
    assert {tuple(e["joints"]) for e in added if e["kind"] == "offset"} == {(1,), (2,)}


def test_the_form_in_which_an_effect_was_found_is_added(loaded, run):
    content = json.loads((loaded / "report.json").read_text("utf-8"))
    content["effects"][0]["form"] = {"link": 0}
    (loaded / "first.json").write_text(json.dumps(content), encoding="utf-8")
    out = loaded / "first_link.json"

    code, _ = run("add", "--from", loaded / "first.json", "--effect", "payload", "--out", out)

    assert code == cli.DONE
    added = json.loads(out.read_text("utf-8"))["effects"]
    assert [e["shape"]["link"] for e in added if e["kind"] == "payload"] == [0]


@pytest.mark.parametrize("link", [99, 0.5])
def test_a_link_that_the_robot_lacks_is_refused(loaded, link, capsys):
    content = json.loads((loaded / "report.json").read_text("utf-8"))
    content["effects"][0]["form"] = {"link": link}
    (loaded / "no_link.json").write_text(json.dumps(content), encoding="utf-8")
    words = ["add", "--from", str(loaded / "no_link.json"), "--effect", "payload"]
    assert cli.main(words) == cli.BAD_INPUT
    assert f"link={link}; expected a whole number from 0 to 1" in capsys.readouterr().err


def test_recordings_that_are_no_numbers_are_refused(loaded, capsys):
    content = json.loads((loaded / "report.json").read_text("utf-8"))
    content["effects"][0]["acts"] = {"trajectories": ["all"]}
    (loaded / "damaged.json").write_text(json.dumps(content), encoding="utf-8")
    words = ["add", "--from", str(loaded / "damaged.json"), "--effect", "payload"]
    assert cli.main(words) == cli.BAD_INPUT
    assert "it must come from skidyn diagnose" in capsys.readouterr().err


@pytest.mark.slow
def test_a_setting_of_a_servo_is_added_to_its_controller(weak_servo, work, run):
    (effect,) = json.loads((weak_servo / "report.json").read_text("utf-8"))["effects"]
    assert (effect["kind"], effect["joints"]) == ("servo_current", [2])
    assert "Current limit of the servo" in (weak_servo / "page.html").read_text("utf-8")
    words = ("add", "--from", weak_servo / "report.json", "--effect", "servo_current")
    code, added = run(*words, "--joints", 2)
    assert code == cli.DONE and added["after"][1] < 0.1 * added["before"][1]
    limit = effect["parameters"]["limit"]["value"]
    assert added["controller"] == {**json.loads(SERVO), "limit": [None, limit]}
    code, clean = run(
        "diagnose", weak_servo / "run.csv", "--urdf", work / "arm.urdf", *MODEL, "--controller",
        json.dumps(added["controller"]), "--effects", "stribeck,servo_current",
    )  # fmt: skip
    assert code == cli.DONE and clean["effects"] == []


def test_other_effects_are_added_beside_the_settings_of_the_report(weak_servo, run):
    words = ("--effect", "stribeck", "--joints", 2)
    code, errors = run("add", "--from", weak_servo / "report.json", *words)
    assert code == cli.DONE and errors["before"][1] < 0.05


def test_a_setting_that_was_not_found_is_refused(weak_servo, capsys):
    words = ["add", "--from", str(weak_servo / "report.json"), "--effect", "servo_gain"]
    assert cli.main(words) == cli.BAD_INPUT
    assert "no servo_gain on these joints; it is a setting of the servo" in capsys.readouterr().err


def test_a_damaged_setting_is_refused(weak_servo, capsys):
    content = json.loads((weak_servo / "report.json").read_text("utf-8"))
    content["effects"][0]["parameters"] = {}
    (weak_servo / "damaged.json").write_text(json.dumps(content), encoding="utf-8")
    words = ["add", "--from", str(weak_servo / "damaged.json"), "--effect", "servo_current"]
    assert cli.main(words) == cli.BAD_INPUT
    assert "it must come from skidyn diagnose" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("viscous",), "has viscous on these joints already"),
        (("torque_ripple", "--joints", "2"), "shape parameter N"),
        (("coupling_spring", "--joints", "1"), "--joints 1,2"),
        (("temperature_friction",), "needs joint temperatures"),
    ],
)
def test_what_cannot_be_added_is_told_in_a_line(diagnosed, capsys, words, told):
    assert cli.main(["add", "--from", str(diagnosed / "report.json"), "--effect", *words]) == 2
    assert told in capsys.readouterr().err
