# SPDX-License-Identifier: BSD-3-Clause
"""Input that was made to do harm, and names that hold markup."""

import json
import os
import sys
import warnings
import zipfile
from argparse import Namespace
from importlib.resources import files

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import formula
from skidyn.evidence import Evidence
from skidyn.exceptions import EffectError, LogError, SkidynError
from skidyn.identification import RBDRegressor
from skidyn.logs import read_log
from skidyn.robots import Robot

LINK = '<link name="{}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" '
LINK += 'ixz="0" iyz="0"/></inertial></link>'
JOINT = '<joint name="{}" type="continuous"><parent link="{}"/><child link="{}"/>{}'
JOINT += '<axis xyz="0 1 0"/></joint>'


def chain(joints, more=""):
    text = "<robot name='r'>" + more + LINK.format("l0")
    for k, name in enumerate(joints):
        text += LINK.format(f"l{k + 1}") + JOINT.format(name, f"l{k}", f"l{k + 1}", "")
    return text + "</robot>"


def test_entities_are_never_expanded():
    lol = '<!DOCTYPE robot [<!ENTITY a "lol"><!ENTITY b "&a;&a;&a;&a;">]>'
    other = '<!DOCTYPE robot [<!ENTITY f SYSTEM "file:///etc/passwd">]>'
    for declaration in (lol, other):
        with pytest.raises(SkidynError, match="document type or entities"):
            Robot.from_urdf(declaration + chain(["j"]))


@pytest.fixture
def world(tmp_path, monkeypatch):
    """A secret file beside the working folder, and the names by which an attacker may call it."""
    (tmp_path / "secret").mkdir()
    secret = tmp_path / "secret" / "secret.stl"
    secret.write_text("the secret")
    (tmp_path / "work" / "x").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "work")
    names = [str(secret), "../secret/secret.stl", secret.as_uri(), "x/../../secret/secret.stl"]
    return secret, [*names, "package://../../secret/secret.stl"]


def opened(call):
    """Real paths of all files that a call opens, whatever library opens them."""
    seen = []
    _LISTENERS.append(seen)
    try:
        call()
    finally:
        _LISTENERS.remove(seen)
    return {os.path.realpath(name) for name in seen}


_LISTENERS: list[list[str]] = []


def _audit(event, arguments):
    if event == "open" and isinstance(arguments[0], (str, bytes)):
        for seen in _LISTENERS:
            seen.append(os.fsdecode(arguments[0]))


sys.addaudithook(_audit)  # cannot be removed, so it is silent without a listener


def test_the_ear_hears_an_open_file(world):
    secret, names = world
    for name in (names[0], names[1], names[3]):
        assert str(secret) in opened(lambda name=name: open(name).close())


def test_files_that_a_description_names_are_not_opened(world):
    secret, names = world
    for name in names:
        mesh = f'<geometry><mesh filename="{name}"/></geometry>'
        picture = (
            f'<visual>{mesh}<material name="m"><texture filename="{name}"/></material></visual>'
        )
        inside = f"</inertial>{picture}<collision>{mesh}</collision>"
        text = chain(["j"]).replace("</inertial>", inside)
        space = 'xmlns:xi="http://www.w3.org/2001/XInclude"'
        more = f'<include filename="{name}"/><xi:include {space} href="{name}"/></robot>'
        text = text.replace("</robot>", more)
        text = f'<?xml-stylesheet href="{name}"?>{text}'
        with open("robot.urdf", "w") as file:
            file.write(text)
        with open("robot.urdf.skidyn.json", "w") as file:
            file.write(json.dumps({"include": name}))
        heard = opened(lambda: Robot.from_urdf("robot.urdf"))
        assert os.path.realpath("robot.urdf") in heard
        assert str(secret) not in heard and os.path.realpath("robot.urdf.skidyn.json") not in heard


def test_numbers_of_an_hdf5_log_do_not_lie_in_other_files(world):
    h5py = pytest.importorskip("h5py")
    secret, _ = world
    time = np.arange(10.0)
    with h5py.File("external.h5", "w") as file:
        file["time"] = time
        file.create_dataset("q1", (10,), "u1", external=[(str(secret), 0, 10)])
    with h5py.File("virtual.h5", "w") as file:
        file["time"] = time
        layout = h5py.VirtualLayout((10,), "f8")
        layout[:] = h5py.VirtualSource("../secret/other.h5", "q1", shape=(10,))
        file.create_virtual_dataset("q1", layout)
    for name in ("external.h5", "virtual.h5"):
        told = f"{name}: the numbers of /q1 are stored in another file"
        with pytest.raises(LogError, match=told):
            read_log(name)
    with h5py.File("link.h5", "w") as file:
        file["time"], file["q1"], file["tau1"] = time, time, time
        file["dq1"] = h5py.ExternalLink("../secret/other.h5", "/q1")
    with h5py.File("../secret/other.h5", "w") as file:
        file["q1"] = np.full(10, 7.0)
    np.testing.assert_allclose(read_log("link.h5", check=False)["dq1"], 1.0)  # derived from q1


def test_a_bag_reads_no_database_outside_its_folder(world):
    rosbags = pytest.importorskip("rosbags.rosbag2")
    from pathlib import Path

    secret, _ = world
    with rosbags.Writer("bag", version=9):
        pass
    database = next(Path("bag").glob("*.db3"))
    database.rename(secret.parent / database.name)
    metadata = Path("bag/metadata.yaml")
    text = metadata.read_text()
    metadata.write_text(text.replace(database.name, f"../../secret/{database.name}"))
    heard = opened(lambda: _refused(lambda: read_log("bag")))
    assert not {f for f in heard if f.startswith(str(secret.parent))}


@pytest.mark.parametrize("suffix", ["mat", "feather"])
def test_modules_that_come_with_a_log_are_not_imported(world, suffix):
    """These formats are decoded in another process first."""
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=1, duration=1.0).frame
    if suffix == "mat":
        from scipy.io import savemat

        savemat("log.mat", {name: log[name].to_numpy() for name in log})
    else:
        pytest.importorskip("pyarrow")
        log.to_feather("log.feather")
    for name in ("numpy", "scipy", "pyarrow", "resource"):
        with open(f"{name}.py", "w") as file:
            file.write("open('harm', 'w').close()\n")
    assert len(read_log(f"log.{suffix}", check=False)) == len(log)
    assert not os.path.exists("harm")


def test_a_report_makes_no_command_write_where_it_says(world):
    from skidyn.cli import main

    secret, names = world
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=4, duration=4.0)
    log.frame.to_csv("log.csv", index=False)
    urdf = files("skidyn.datasets") / "robots" / "planar_arm.urdf"
    evil = {"logs": ["log.csv"], "urdf": str(urdf), "model": "rigid_body"}
    evil |= {"out": names[1], "html": names[1], "save": names[1], "func": "os.remove"}
    with open("report.json", "w") as file:
        json.dump({"verdict": "complete", "provenance": {"options": evil, "sha256": {}}}, file)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the log differs from the one of the report
        main(["add", "--from", "report.json", "--effect", "coulomb"])
    assert secret.read_text() == "the secret"


@pytest.mark.parametrize(
    "change",
    [{"logs": [5]}, {"logs": "log.csv"}, {"urdf": None}, {"model": 1}, {"joints": ["a"]}],
)
def test_a_report_with_options_of_other_types_is_refused(world, change):
    from skidyn._commands._input import recorded_options

    options = {"logs": ["log.csv"], "urdf": "a.urdf"} | change
    with open("report.json", "w") as file:
        json.dump({"provenance": {"options": options}}, file)
    with pytest.raises(SkidynError, match=f"option {next(iter(change))} of the diagnosis is"):
        recorded_options(Namespace(report="report.json"))


def test_names_inside_an_archive_lead_nowhere(world):
    secret, names = world
    arrays = {"time": np.arange(10.0), "q1": np.arange(10.0)}
    np.savez("log.npz", **arrays)
    with zipfile.ZipFile("log.npz", "a") as archive:
        for name in names:
            archive.writestr(f"{name}.npy", b"evil")
    _refused(lambda: read_log("log.npz", check=False))
    assert secret.read_text() == "the secret"
    assert [f.name for f in secret.parent.iterdir()] == ["secret.stl"]
    assert [f.name for f in secret.parents[1].joinpath("work").glob("*.*")] == ["log.npz"]


def _refused(call):
    try:
        call()
    except SkidynError:
        pass


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('ls')",
        "q1.__class__",
        "(lambda: 1)()",
        "[q1 for q1 in ()]",
        "9**9**9",
        "exp(q1, q2)",
        "open('a')",
        "q1 if t else q2",
        "(" * 150 + "q1",
    ],
)
def test_formulas_are_arithmetic_and_nothing_else(text):
    with pytest.raises(EffectError):
        formula(text, 1)


@settings(max_examples=150, deadline=None)
@given(st.text(max_size=60))
def test_any_text_is_a_formula_or_refused(text):
    try:
        formula(text, 1)
    except EffectError:
        pass


@settings(max_examples=40, deadline=None)
@given(st.text(max_size=40))
def test_any_joint_name_is_kept_or_refused(name):
    from xml.sax.saxutils import quoteattr

    text = chain(["NAME"]).replace('"NAME"', quoteattr(name))
    try:
        assert Robot.from_urdf(text).n_joints == 1
    except SkidynError:
        pass


def test_ten_thousand_joints_are_read():
    robot = Robot.from_urdf(chain([f"j{k}" for k in range(10_000)]))
    assert robot.n_joints == 10_000


def test_a_thousand_joints_move_exactly():
    """All about one axis: every joint carries the inertia of what follows it."""
    n = 1000
    ddq = np.full((1, n), 0.1)
    torque = Robot.from_urdf(chain([f"j{k}" for k in range(n)])).inverse_dynamics(ddq, ddq, ddq)
    speed_up = 0.1 * np.arange(1, n + 1)  # of each link, its inertia is 1
    np.testing.assert_allclose(torque[0], speed_up[::-1].cumsum()[::-1], rtol=1e-10)


def test_a_single_sample_is_refused_or_exact():
    robot = load_planar_arm()
    x = np.array([[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]])
    model = RBDRegressor(robot, effects=(), smooth=False)
    y = robot.inverse_dynamics(x[:, :2], x[:, 2:4], x[:, 4:])
    try:
        assert np.isfinite(model.fit(x, y).predict(x)).all()
    except ValueError as error:
        assert "sample" in str(error) or "row" in str(error)


def test_columns_without_information_get_no_coefficient():
    rng = np.random.default_rng(0)
    a = rng.normal(size=(50, 3))
    a[:, 1] = 0.0
    rows = np.column_stack([a, a @ [1.0, 5.0, 2.0]])
    np.testing.assert_allclose(
        Evidence.from_rows(("a", "b", "c"), {(0, 0): rows}).solve(), [1.0, 0.0, 2.0], atol=1e-12
    )
    twice = np.column_stack([a[:, 0], a[:, 0], a[:, 0] * 2])
    np.testing.assert_allclose(  # the shortest of all solutions
        Evidence.from_rows(("a", "b"), {(0, 0): twice}).solve(), [1.0, 1.0], atol=1e-12
    )


def test_missing_values_are_refused_by_the_model():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=2.0)
    X = log.X.copy()
    X.iloc[100, 3] = np.nan
    with pytest.raises(ValueError, match="NaN"):
        RBDRegressor(log.robot).fit(X, log.y)
