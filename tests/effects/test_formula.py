# SPDX-License-Identifier: BSD-3-Clause
"""Formulas as effects: what they compute, and all that they refuse."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import Signals, formula, get_effect, list_effects
from skidyn.exceptions import EffectError
from skidyn.identification import RBDRegressor


@pytest.fixture
def signals():
    rng = np.random.default_rng(0)
    q, dq, ddq = rng.normal(size=(3, 50, 2))
    return Signals(q, dq, ddq, np.zeros(50, dtype=int), np.arange(50) / 100)


def column(signals, expression, joint=1):
    term = formula(expression, joint)
    return get_effect("formula").columns(signals, joint - 1, **term.shape)[:, 0]


def test_a_formula_is_what_it_says(signals):
    q, dq = signals.q, signals.dq
    expected = 2 * np.sin(q[:, 0] - q[:, 1]) - dq[:, 1] * np.abs(dq[:, 0]) / 3 + signals.time**2

    value = column(signals, "2*sin(q1 - q2) - dq2*abs(dq1)/3 + t**2")

    np.testing.assert_allclose(value, expected)


def test_the_direction_of_motion_is_that_of_dry_friction(signals):
    np.testing.assert_array_equal(column(signals, "sign(dq2)"), signals.sign[:, 1])


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('ls')",
        "q1.__class__",
        "(lambda: 1)()",
        "[q1 for q1 in (1,)]",
        "q1 if q2 else q1",
        "q1 == q2",
        "q1 @ q2",
        "9**9**9",
        "2**q1",
        "open",
        "q0",
        "sin(q1, q2)",
        "sin(x=q1)",
        "'text'",
        "True",
        "q1\n+ import",
        "",
        "((((" * 60,
        "q1 + " * 60 + "q1",
    ],
)
def test_anything_else_is_refused_by_name(text):
    with pytest.raises(EffectError, match="formula"):
        formula(text, joint=1)


@settings(max_examples=200, deadline=None)
@given(st.text(max_size=60) | st.text("qdt123+-*/()., sincoexpab_[]'\"\\\n", max_size=40))
def test_no_text_does_more_than_be_read_or_refused(text):
    try:
        term = formula(text, joint=1)
    except EffectError:
        return
    assert term.shape["expression"] == text


def test_a_joint_the_robot_lacks_and_values_that_are_not_finite(signals):
    with pytest.raises(EffectError, match="no joint 3"):
        column(signals, "q3")
    with pytest.raises(EffectError, match="not finite in row 0"):
        column(signals, "1/t")


def test_a_model_with_a_formula_fits_predicts_and_is_stored():
    log = make_hidden_effect_log(load_planar_arm(), None, random_state=1)
    torque = np.array(log.y)
    torque[:, 1] += 0.7 * np.cos(3 * log.X["q1"])
    model = RBDRegressor(log.robot, ["viscous", "coulomb", formula("cos(3 * q1)", joint=2)])

    model.fit(log.X, torque)

    (term,) = [t for t in model.effect_terms_ if t.kind == "formula"]
    assert model.effect_coefficients_[term][0] == pytest.approx(0.7, rel=0.02)
    again = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(again.predict(log.X), model.predict(log.X))


def test_a_formula_is_no_name_of_the_vocabulary():
    assert "formula" not in list_effects()
