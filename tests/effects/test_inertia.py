# SPDX-License-Identifier: BSD-3-Clause
"""Inertia of a rotor."""

import numpy as np

from skidyn.effects import get_effect


def test_it_follows_the_acceleration_of_its_joint(signals, columns_of):
    np.testing.assert_array_equal(columns_of("rotor_inertia", signals, 1)[:, 0], signals.ddq[:, 1])
    assert get_effect("rotor_inertia").units(prismatic=True) == {"Ia": "kg"}
