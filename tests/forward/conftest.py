# SPDX-License-Identifier: BSD-3-Clause
"""Models with effects of known size, and logs that push them."""

import numpy as np
import pandas as pd
import pytest

from skidyn.identification import RBDRegressor
from skidyn.robots import Robot
from skidyn.simulation import simulate

SLIDER = """<robot name="slider"><link name="base"/><link name="cart"><inertial><mass value="2"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="slide" type="prismatic"><axis xyz="1 0 0"/><parent link="base"/><child link="cart"/>
<limit effort="9" velocity="9" lower="-9" upper="9"/></joint></robot>"""


@pytest.fixture(scope="session")
def fitted():
    """A model of the robot of the URDF with effects of known size."""

    def made(robot, effects, coefficients=None, seed=0):
        n, time = robot.n_joints, np.arange(0, 20, 0.01)
        speed, phase = np.random.default_rng(seed).uniform(1, 4, (2, n))
        angle = speed * time[:, None] + phase
        q, dq, ddq = np.sin(angle), speed * np.cos(angle), -(speed**2) * np.sin(angle)
        names = [f"{s}{j + 1}" for s in ("q", "dq", "ddq") for j in range(n)]
        X = pd.DataFrame(np.hstack([q, dq, ddq]), columns=names).assign(time=time)
        model = RBDRegressor(robot, effects, "nominal", smooth=False)
        model.fit(X, robot.inverse_dynamics(q, dq, ddq) + 0.1 * dq)
        for term in model.effect_terms_:
            model.effect_coefficients_[term] = np.asarray(
                (coefficients or {})[term.kind], dtype=float
            )
        return model

    return made


@pytest.fixture(scope="session")
def log_of():
    """A log that starts in a state, pushed by a function of time."""

    def made(robot, start_q, start_dq, torque, time):
        n = robot.n_joints
        table = {f"q{j + 1}": start_q[j] + 0 * time for j in range(n)}
        table |= {f"dq{j + 1}": start_dq[j] + 0 * time for j in range(n)}
        table |= {f"ddq{j + 1}": 0 * time for j in range(n)}
        return pd.DataFrame(table | {"time": time}), np.column_stack(
            [torque(time, j) for j in range(n)]
        )

    return made


@pytest.fixture(scope="session")
def moved():
    """Simulated positions and velocities."""

    def made(model, X, y=None, **options):
        out = simulate(model, X, y, **options)
        n = model.robot_.n_joints
        return (out[[f"{s}{j + 1}" for j in range(n)]].to_numpy() for s in ("q", "dq"))

    return made


@pytest.fixture(scope="session")
def slider(fitted):
    """A cart of 2 kg on a rail."""

    def made(effects, coefficients):
        return fitted(Robot.from_urdf(SLIDER), effects, coefficients)

    return made
