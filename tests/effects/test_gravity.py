# SPDX-License-Identifier: BSD-3-Clause
"""Another direction of gravity."""

import numpy as np

from skidyn.effects import get_effect


def test_tilt_is_a_change_of_gravity(signals, robot):
    tilted = np.asarray(robot.gravity) + [0.3, -0.2, 0.0]
    rest = np.zeros_like(signals.q)
    change = robot.inverse_dynamics(signals.q, rest, rest, gravity=tilted)
    change = change - robot.inverse_dynamics(signals.q, rest, rest)
    blocks = get_effect("base_tilt").torque_columns(signals, (0, 1))
    for j in range(2):
        np.testing.assert_allclose(blocks[j][:, :2] @ [0.3, -0.2], change[:, j], atol=1e-10)
