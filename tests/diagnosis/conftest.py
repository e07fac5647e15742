# SPDX-License-Identifier: BSD-3-Clause
"""Diagnoses on which several tests look: a spring is missing, nothing is, something unknown is."""

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.effects import Signals
from skidyn.exceptions import LogWarning
from skidyn.identification import RBDRegressor

#: What the simulator hides, the signals it depends on, the formula of its torque, and its size.
HIDDEN = {
    "unknown_cross_drag": ({"dq1", "dq2"}, "dq1 * abs(dq2)", "c"),
    "unknown_pose_friction": ({"dq1", "q2"}, "sin(q2) * sign(dq1)", "a"),
    "unknown_cable": ({"q1", "q2"}, "cos(q1 - q2)", "a"),
}


@pytest.fixture(scope="session")
def motion():
    """Eight recordings of 6 s of a planar arm, each a little faster and 10 s after the last."""
    run, since = np.repeat(np.arange(8), 600), np.tile(np.arange(0, 6, 0.01), 8)
    speed = np.array([0.9, 1.3]) + 0.1 * run[:, None]
    q, dq = np.sin(speed * since[:, None]), speed * np.cos(speed * since[:, None])
    time, robot = 10.0 * run + since, load_planar_arm()
    return Signals(q, dq, -(speed**2) * q, run, time=time, robot=robot)


@pytest.fixture(scope="session")
def without_friction():
    """A planar arm of which the torque is that of the bodies, with noise of 2 % of its size."""
    robot = load_planar_arm()
    log = make_hidden_effect_log(robot, None, noise="low", random_state=3)
    q, dq, ddq = (log.X[[f"{s}1", f"{s}2"]].to_numpy() for s in ("q", "dq", "ddq"))
    torque = robot.inverse_dynamics(q, dq, ddq)
    size = np.std(torque, axis=0)
    torque += np.random.default_rng(0).normal(0.0, 0.02, torque.shape) * size
    return SimpleNamespace(robot=robot, X=log.X, q=q, dq=dq, torque=torque, size=size)


@pytest.fixture(scope="session")
def spring_log():
    return make_hidden_effect_log(load_planar_arm(), "spring", joints=[2])


@pytest.fixture(scope="session")
def missing(spring_log):
    return diagnose(RBDRegressor(spring_log.robot), spring_log.X, spring_log.y)


@pytest.fixture(scope="session")
def complete_log():
    """A log in which nothing is hidden."""
    return make_hidden_effect_log(load_planar_arm(), None, n_trajectories=6, duration=6.0)


@pytest.fixture(scope="session")
def complete(complete_log):
    return diagnose(RBDRegressor(complete_log.robot), complete_log.X, complete_log.y)


@pytest.fixture(scope="session")
def pushed(complete):
    """Joint 2 is pushed in recording 3, from 4.0 to 4.6 s after its start."""
    X, y = complete.data
    y = y.copy()
    run = (X["trajectory"] == 3).to_numpy()
    time = X["time"].to_numpy() - X["time"][run].iloc[0]
    y[run & (time > 4.0) & (time < 4.6), 1] += 3.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)  # the torque leaps there
        return diagnose(complete.base_model, X, y, effects=[])


@pytest.fixture(
    scope="session",
    params=[
        "unknown_cross_drag",
        *(pytest.param(k, marks=pytest.mark.slow) for k in list(HIDDEN)[1:]),
    ],
)
def nameless(request):
    """A torque that no name fits: its log, its diagnosis, its signals and its formula."""
    log = make_hidden_effect_log(load_planar_arm(), request.param, random_state=5)
    variables, formula, size = HIDDEN[request.param]
    return SimpleNamespace(
        log=log,
        diagnosis=diagnose(RBDRegressor(log.robot), log.X, log.y),
        variables=variables,
        formula=formula,
        size=log.parameters[size],
    )


@pytest.fixture(scope="session")
def arm_log():
    return make_hidden_effect_log(load_planar_arm(), None, noise="low", random_state=4)


@pytest.fixture(scope="session")
def found_in():
    """Kinds and joints of what is named where the model has some effects, and the log no fault."""

    def found(robot, X, y, effects=("viscous", "coulomb")):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            diagnosis = diagnose(RBDRegressor(robot, effects=list(effects)), X, y, checks=())
        together = {}
        for finding in diagnosis.findings:
            together.setdefault(finding.kind, set()).update(finding.joints)
        return together

    return found
