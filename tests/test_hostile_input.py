# SPDX-License-Identifier: BSD-3-Clause
"""Input that was made to do harm, and names that hold markup."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skidyn._exceptions import EffectError, SkidynError
from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import formula
from skidyn.evidence import Evidence
from skidyn.rigid_body import RBDRegressor
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


def test_files_that_a_description_names_are_not_opened(tmp_path):
    mesh = '<visual><geometry><mesh filename="{}"/></geometry></visual>'
    secret = tmp_path / "secret"
    secret.mkdir()  # opening a folder as a file would fail
    text = chain(["j"]).replace("</inertial>", "</inertial>" + mesh.format(secret), 1)
    text = text.replace(str(secret), f"{secret}/../../../../etc/passwd")
    assert Robot.from_urdf(text).n_joints == 1


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
