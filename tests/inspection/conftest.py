# SPDX-License-Identifier: BSD-3-Clause
"""A small simulated log and models of it."""

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="needs skidyn[plot]")

import matplotlib.pyplot as plt

from skidyn.datasets import load_planar_arm, make_hidden_effect_log


class Constant:
    """Predicts the same torque everywhere; knows its robot."""

    def __init__(self, robot, torque=0.0):
        self.robot, self.torque = robot, torque

    def predict(self, X):
        return np.full((len(X), self.robot.n_joints), float(self.torque))


@pytest.fixture(scope="session")
def log():
    return make_hidden_effect_log(load_planar_arm(), "stribeck", n_trajectories=2, duration=4.0)


@pytest.fixture
def model(log):
    return Constant(log.robot)


@pytest.fixture
def richer(log):
    return Constant(log.robot, 0.5)


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")
