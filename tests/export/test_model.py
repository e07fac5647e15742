# SPDX-License-Identifier: BSD-3-Clause
"""Which effects are functions of q, dq and ddq, and what becomes of the others."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.effects import Coefficient, Effect, Term, register_effect, unregister_effect
from skidyn.export import python_source, static_model
from skidyn.identification import RBDRegressor

MEMORY = [
    Term("dahl", (1,), {"presliding": 0.02}),
    Term("maxwell_slip", (2,), {"presliding": 0.02}),
    Term("offset", (1,), {"trajectory": 0}),
]


def test_static_effects_are_all_held(models):
    for model in models.values():
        assert static_model(model).left == []


def test_the_function_is_the_model_without_what_is_left_out(fit, states):
    robot = load_planar_arm()
    model = fit(robot, ["viscous", *MEMORY])
    text, namespace = python_source(model), {}
    assert "Left out: dahl of joint1; maxwell_slip of joint2; offset of joint1." in text
    exec(text, namespace)
    motion = states(robot)
    for term in MEMORY:
        model.effect_coefficients_[term] = 0.0 * model.effect_coefficients_[term]
    expected = model.predict(np.hstack(motion))
    np.testing.assert_allclose(namespace["inverse_dynamics"](*motion), expected, atol=1e-10)


def test_effects_of_users_are_written_down_from_their_own_code(fit, states):
    class Drag(Effect):
        kind, title, formula = "drag", "Drag", "c dq abs(dq)"
        coefficients = (Coefficient("c", "N m s^2/rad^2"),)

        def columns(self, signals, joint, **shape):
            dq = signals.dq[:, joint]
            return (np.minimum(2.0, np.abs(dq)) * dq / (1.0 + dq**2) + np.sqrt(np.abs(dq)))[:, None]

    class Batch(Drag):
        kind = "batch"

        def columns(self, signals, joint, **shape):
            return (signals.dq[:, joint] - np.mean(signals.dq[:, joint]))[:, None]

    register_effect(Drag)
    register_effect(Batch)
    try:
        model = fit(load_planar_arm(), ["drag", ("batch", [1])])
        static = static_model(model)
        assert [t.kind for t in static.left] == ["batch"]  # depends on the other samples
        namespace = {}
        exec(python_source(model), namespace)
        model.effect_coefficients_[static.left[0]] = np.zeros(1)
        motion = states(model.robot_)
        expected = model.predict(np.hstack(motion))
        np.testing.assert_allclose(namespace["inverse_dynamics"](*motion), expected, atol=1e-10)
    finally:
        unregister_effect("drag")
        unregister_effect("batch")


def test_load_friction_includes_the_load_of_the_payload(fit):
    effects = ["load_dependent_friction", "payload"]
    model = fit(load_planar_arm(), effects, parameters="nominal")
    assert static_model(model).left == []


def test_only_fitted_models_are_exported():
    with pytest.raises(ValueError, match="not fitted"):
        python_source(RBDRegressor(load_planar_arm()))
    with pytest.raises(ValueError, match="model is dict; expected a fitted RBDRegressor"):
        python_source({})
