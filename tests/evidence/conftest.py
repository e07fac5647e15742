# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.effects import Signals, make_terms
from skidyn.evidence import make_problem


def _problem(n_trajectories, rate=100.0):
    robot = load_planar_arm()
    t = np.arange(0, 12, 1 / rate)
    parts = []
    for k in range(n_trajectories):
        phase = t[:, None] * [1.1 + 0.1 * k, 1.7]
        w = np.array([1.1 + 0.1 * k, 1.7])
        parts.append((np.sin(phase), w * np.cos(phase), -(w**2) * np.sin(phase)))
    q, dq, ddq = (np.vstack(x) for x in zip(*parts, strict=True))
    label = np.repeat(np.arange(n_trajectories), len(t))
    signals = Signals(q, dq, ddq, label, time=np.tile(t, n_trajectories), robot=robot)
    torque = robot.inverse_dynamics(q, dq, ddq, parameters=1.1 * robot.inertial_parameters)
    terms = make_terms(["viscous"], 2)
    return make_problem(
        signals, torque + 0.4 * dq, robot=robot, rigid_body=True, terms=terms, smooth=False
    )


@pytest.fixture
def planar_problem():
    """Maker of the problem of a planar arm with viscous friction, of so many trajectories."""
    return _problem
