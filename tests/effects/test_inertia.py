# SPDX-License-Identifier: BSD-3-Clause
"""Inertia of a rotor."""

import numpy as np

from skidyn.effects import get_effect


def test_it_follows_the_acceleration_of_its_joint(signals, columns_of):
    np.testing.assert_array_equal(columns_of("rotor_inertia", signals, 1)[:, 0], signals.ddq[:, 1])
    assert get_effect("rotor_inertia").units(prismatic=True)["Ia"] == "kg"


def test_an_inertia_that_varies_along_the_travel_conserves_energy(signals, columns_of):
    shape = {"varying": 1.0, "q_middle": 0.1}
    size = np.array([0.5, 0.2, 0.3])
    q, dq = signals.q[:300, 0], signals.dq[:300, 0]
    torque = (columns_of("rotor_inertia", signals, 0, **shape) @ size)[:300]
    x = q - shape["q_middle"]
    energy = 0.5 * (size[0] + size[1] * x + size[2] * x**2) * dq**2
    power, step = torque * dq, np.diff(signals.time[:300])
    work = np.r_[0.0, np.cumsum(0.5 * (power[1:] + power[:-1]) * step)]
    np.testing.assert_allclose(work, energy - energy[0], atol=2e-3 * np.ptp(energy))
    effect = get_effect("rotor_inertia")
    assert {c.name for c in effect.coefficients_of(shape)} | {"q_middle"} == set(effect.units())
