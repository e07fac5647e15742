# SPDX-License-Identifier: BSD-3-Clause
"""Columns that are periodic in the position."""

import numpy as np

from skidyn.effects import get_effect


def test_periodic_effects_name_amplitude_and_phase(signals):
    q = signals.q[:, 0]
    ripple, friction = get_effect("torque_ripple"), get_effect("position_dependent_friction")
    a = np.array([0.3, -0.4])
    found = ripple.parameters(a, {"N": 20.0})
    np.testing.assert_allclose(
        ripple.columns(signals, 0, N=20.0) @ a, found["A"] * np.sin(20 * q - found["phase"])
    )
    found = friction.parameters(a, {"n": 2.0})
    expected = found["A"] * np.cos(2 * q - found["phase"]) * signals.sign[:, 0]
    np.testing.assert_allclose(friction.columns(signals, 0, n=2.0) @ a, expected)


def test_friction_in_one_spot_of_the_travel(signals):
    effect = get_effect("position_dependent_friction")
    columns = effect.columns(signals, 0, place=0.2, width=0.05)
    near = np.exp(-0.5 * ((signals.q[:, 0] - 0.2) / 0.05) ** 2)
    np.testing.assert_allclose(columns[:, 0], near * signals.sign[:, 0])
    np.testing.assert_allclose(columns[:, 1], near * signals.dq[:, 0])
    found = effect.parameters(np.array([1.0, 2.0]), {"place": 0.2, "width": 0.05})
    assert found == {"dFc": 1.0, "dFv": 2.0, "place": 0.2, "width": 0.05}
    assert set(found) <= set(effect.units())


def test_friction_along_the_travel_may_have_an_overtone(signals):
    effect, shape = get_effect("position_dependent_friction"), {"n": 2.0, "overtone": 1.0}
    values = np.array([0.3, -0.4, 0.0, 0.2])
    assert [c.name for c in effect.coefficients_of(shape)] == ["a", "b", "a2", "b2"]
    found, q = effect.parameters(values, shape), signals.q[:, 0]
    waves = [found["A"] * np.cos(2 * q - found["phase"]), 0.2 * np.sin(4 * q)]
    np.testing.assert_allclose(
        effect.columns(signals, 0, **shape) @ values, sum(waves) * signals.sign[:, 0], atol=1e-12
    )
    assert (found["A2"], found["phase2"]) == (0.2, np.pi / 2)
    assert set(found) - set(shape) <= set(effect.units())


def test_viscous_friction_may_vary_along_the_travel(signals):
    effect, shape = get_effect("position_dependent_friction"), {"n": 2.0, "viscous": 1.0}
    values = np.array([0.3, -0.4])
    found, q = effect.parameters(values, shape), signals.q[:, 0]
    np.testing.assert_allclose(
        effect.columns(signals, 0, **shape) @ values,
        found["Av"] * np.cos(2 * q - found["phase"]) * signals.dq[:, 0],
    )
    assert effect.units()["Av"] == "N m s/rad"
