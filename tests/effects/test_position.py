# SPDX-License-Identifier: BSD-3-Clause
"""Columns that are periodic in the position."""

import numpy as np

from skidyn.effects import (
    get_effect,
)


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
