# SPDX-License-Identifier: BSD-3-Clause
"""Exported functions of a fitted model against its own predict."""

import ctypes

import numpy as np
import pytest

from skidyn.datasets import load_scara
from skidyn.export import c_source, model_terms, python_source
from skidyn.rigid_body import RBDRegressor
from skidyn.rigid_body._compiled import compile_library, find_compiler


def fitted(*effects):
    robot = load_scara()
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, 400, 4))
    tau = robot.inverse_dynamics(q, dq, ddq) + 0.3 * dq + 0.2 * np.sign(dq) + 0.1 * ddq + 0.05
    return RBDRegressor(robot, effects=effects).fit(np.hstack([q, dq, ddq]), tau)


def test_exported_functions_equal_predict():
    model = fitted("viscous", "coulomb", "offset")
    terms, rest = model_terms(model)
    assert rest == {}
    q, dq, ddq = np.random.default_rng(1).normal(size=(3, 50, 4))
    dq[:10] *= 1e-3  # where the direction of motion is blurred
    expected = model.predict(np.hstack([q, dq, ddq]))
    namespace = {}
    exec(python_source(model.robot, **terms), namespace)
    np.testing.assert_allclose(namespace["inverse_dynamics"](q, dq, ddq), expected, atol=1e-9)
    if find_compiler() is None:
        pytest.skip("no C compiler")
    text = c_source(model.robot, **terms)
    function = compile_library(text, ("-shared", "-fPIC")).skidyn_inverse_dynamics
    for k in range(len(q)):
        arrays = [np.ascontiguousarray(signal[k]) for signal in (q, dq, ddq)]
        out = np.empty(4)
        function(*(ctypes.c_void_p(a.ctypes.data) for a in (*arrays, out)))
        np.testing.assert_allclose(out, expected[k], atol=1e-9)


def test_effects_that_no_function_holds_are_handed_out():
    terms, rest = model_terms(fitted("viscous", "asymmetric_friction"))
    assert "viscous" in terms and "coulomb" not in terms
    assert sorted(rest) == [f"asymmetric_friction of joint{j}" for j in (1, 2, 3, 4)]
