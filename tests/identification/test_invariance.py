# SPDX-License-Identifier: BSD-3-Clause
"""What is identified and diagnosed depends on the robot, and not on its size or its units."""

import re
from importlib.resources import files

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from skidyn.datasets import load_planar_arm, load_scara, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.evidence import Evidence
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

LOG = make_hidden_effect_log(
    load_planar_arm(), "stribeck", joints=[2], n_trajectories=6, duration=8.0, rate=100.0
)
TEXT = (files("skidyn.datasets") / "robots" / "planar_arm.urdf").read_text()


def scaled(mass=1.0, length=1.0):
    """The arm with masses in other units, and lengths in others."""

    def change(match):
        power = {"mass value": 0, "xyz": 1}.get(match[1], 2)
        weight = 1.0 if match[1] == "xyz" else mass
        numbers = [float(x) * weight * length**power for x in match[2].split()]
        return f'{match[1]}="{" ".join(map(repr, numbers))}"'

    inertial = re.sub(r'(mass value|i[xyz]{2})="([^"]+)"', change, TEXT)
    text = re.sub(r'(?<=origin )(xyz)="([^"]+)"', change, inertial)
    return Robot.from_urdf(text, gravity=(0.0, 0.0, -9.81 * length))


@pytest.fixture(scope="module")
def reference():
    return RBDRegressor(load_planar_arm()).fit(LOG.X, LOG.y)


@pytest.mark.parametrize("factor", [1e-6, 1e-3, 1e3, 1e6])
def test_robots_from_a_milligram_to_thousands_of_tonnes(reference, factor):
    model = RBDRegressor(scaled(mass=factor)).fit(LOG.X, LOG.y * factor)
    assert model.coef_names_ == reference.coef_names_
    np.testing.assert_allclose(model.coef_ / factor, reference.coef_, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(model.coef_std_ / factor, reference.coef_std_, rtol=1e-4, atol=1e-9)


@pytest.mark.parametrize("length", [1e-3, 1e3])
def test_millimetres_and_kilometres(reference, length):
    """Lengths in other units, gravity too: torque grows with their square."""
    model = RBDRegressor(scaled(length=length)).fit(LOG.X, LOG.y * length**2)
    np.testing.assert_allclose(
        model.predict(LOG.X) / length**2, reference.predict(LOG.X), rtol=1e-6, atol=1e-6
    )


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_the_diagnosis_is_that_of_the_same_robot(factor):
    def said(robot, torque, unit):
        found = diagnose(RBDRegressor(robot), LOG.X, torque, effects=["stribeck", "spring"])
        numbers = [f.error_drop for f in found.findings]
        return [(f.kind, f.joints) for f in found.findings], numbers, found.rmse_after / unit

    kinds, drops, errors = said(load_planar_arm(), LOG.y, 1.0)
    assert kinds == [("stribeck", (2,))]
    answer = said(scaled(mass=factor), LOG.y * factor, factor)
    assert answer[0] == kinds
    np.testing.assert_allclose(answer[1], drops, rtol=1e-4)
    np.testing.assert_allclose(answer[2], errors, rtol=1e-4)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**31), factors=st.lists(st.floats(1e-6, 1e6), min_size=3, max_size=3))
def test_units_of_the_columns_do_not_change_the_fit(seed, factors):
    rows = np.random.default_rng(seed).normal(size=(40, 4))
    one = Evidence.from_rows(("a", "b", "c"), {(0, 0): rows}).solve()
    other = Evidence.from_rows(("a", "b", "c"), {(0, 0): rows * [*factors, 1.0]}).solve()
    np.testing.assert_allclose(other * factors, one, rtol=1e-8, atol=1e-10)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**31), order=st.permutations(range(5)))
def test_the_order_of_recordings_does_not_change_the_fit(seed, order):
    rows = np.random.default_rng(seed).normal(size=(5, 30, 3))
    parts = [Evidence.from_rows(("a", "b"), {(k, 0): rows[k]}) for k in range(5)]
    forth, back = (sum(p[1:], p[0]) for p in (parts, [parts[k] for k in order]))
    np.testing.assert_allclose(forth.solve(), back.solve(), rtol=1e-10)
    np.testing.assert_allclose(
        Evidence.from_rows(("a", "b"), {(0, 0): np.vstack(rows)}).solve(), forth.solve(), rtol=1e-9
    )


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_rigid_bodies_know_no_direction_of_time(seed):
    """Forces of inertia are even in the velocity; those of gravity have a potential."""
    robot = load_scara()
    q, dq, ddq = np.random.default_rng(seed).uniform(-2, 2, (3, 6, robot.n_joints))
    np.testing.assert_allclose(
        robot.inverse_dynamics(q, -dq, ddq), robot.inverse_dynamics(q, dq, ddq), atol=1e-10
    )
    # A torque field with a potential has a symmetric derivative.
    step, zero = 1e-6, np.zeros_like(q)
    slopes = np.stack(
        [
            robot.inverse_dynamics(q + step * e, zero, zero)
            - robot.inverse_dynamics(q - step * e, zero, zero)
            for e in np.eye(robot.n_joints)
        ],
        axis=-1,
    ) / (2 * step)
    np.testing.assert_allclose(slopes, slopes.transpose(0, 2, 1), atol=1e-5)
