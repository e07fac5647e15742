# SPDX-License-Identifier: BSD-3-Clause
"""Programs as plain Python."""

import math

import numpy as np

from skidyn.datasets import load_scara
from skidyn.dynamics import python_function


def test_program_text_is_plain_python():
    program = load_scara()._engine.fixed_inverse_dynamics(load_scara().inertial_parameters)
    text = python_function(program, "torque")
    namespace = {"sin": math.sin, "cos": math.cos}
    exec(text, namespace)
    q, dq, ddq = [[0.1, 0.2, -0.1, 0.4]], [[1.0, 2.0, 0.3, 0.4]], [[0.5, 0.0, 1.0, 2.0]]
    torque = namespace["torque"](q[0], dq[0], ddq[0])
    np.testing.assert_allclose(torque, load_scara().inverse_dynamics(q, dq, ddq)[0], atol=1e-12)
