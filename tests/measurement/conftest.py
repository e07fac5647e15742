# SPDX-License-Identifier: BSD-3-Clause
"""A planar arm, its motion and log, and what the checks tell of them."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.effects import Signals
from skidyn.logs import check_log
from skidyn.measurement import Measurement, check_measurement


@pytest.fixture(scope="session")
def arm():
    return load_planar_arm()


@pytest.fixture(scope="session")
def recorded(arm):
    return make_hidden_effect_log(arm, "stribeck", joints=[2], n_trajectories=4, random_state=3)


@pytest.fixture(scope="session")
def signals():
    t = np.arange(0, 20, 0.01)
    rate = np.array([0.7, 1.3])
    phase = t[:, None] * rate
    return Signals(
        1.2 * np.sin(phase),
        1.2 * rate * np.cos(phase),
        -1.2 * rate**2 * np.sin(phase),
        np.zeros(len(t), dtype=int),
        time=t,
    )


@pytest.fixture(scope="session")
def torque(arm, signals):
    noise = np.random.default_rng(0).normal(0, 0.05, signals.q.shape)
    friction = 0.8 * signals.dq + 1.2 * np.sign(signals.dq)
    return arm.inverse_dynamics(signals.q, signals.dq, signals.ddq) + friction + noise


@pytest.fixture(scope="session")
def found(arm):
    """Suspicions of signals and torque."""

    def checked(signals, torque, robot=arm):
        return check_measurement(Measurement(signals, torque, robot, ("shoulder", "elbow")))

    return checked


@pytest.fixture(scope="session")
def told_of(arm):
    """Suspicions of a log by their checks."""

    def told(frame, robot=arm):
        return {s.check: s for s in check_log(frame, robot).checks}

    return told


@pytest.fixture(scope="session")
def only():
    """Assert that one thing is suspected, how surely, and the option that mends it."""

    def asserted(suspicions, check, certainty, remedy):
        told = [s for s in suspicions if s.certainty != "noted"]
        assert [s.check for s in told] == [check], told
        assert told[0].certainty == certainty
        assert (told[0].remedy and told[0].remedy.option) == remedy

    return asserted


@pytest.fixture(scope="session")
def short(arm):
    """A short log that hides nothing."""
    return make_hidden_effect_log(arm, None, n_trajectories=4, duration=4.0, random_state=3).frame


@pytest.fixture(scope="session")
def checked():
    """Log of a UR5 with an effect, and its checks, once: those of six joints take seconds."""
    robot = load_ur5()

    @cache
    def made(effect, **options):
        frame = make_hidden_effect_log(robot, effect, **options).frame
        return SimpleNamespace(robot=robot, frame=frame, checks=check_log(frame, robot).checks)

    return made


@pytest.fixture(scope="session")
def loaded(checked):
    """A UR5 that carries a load in some recordings."""
    return checked("payload", n_trajectories=5, duration=6.0, random_state=5)
