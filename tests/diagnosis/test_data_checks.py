# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

from skidyn._signals import Signals
from skidyn.datasets import load_planar_arm
from skidyn.diagnosis._data_checks import suspicions

ROBOT = load_planar_arm()


@pytest.fixture
def signals():
    t = np.arange(0, 20, 0.01)
    rate = np.array([0.7, 1.3])
    phase = t[:, None] * rate
    return Signals(
        1.2 * np.sin(phase),
        1.2 * rate * np.cos(phase),
        -1.2 * rate**2 * np.sin(phase),
        np.zeros(len(t)),
        time=t,
    )


@pytest.fixture
def torque(signals):
    return ROBOT.inverse_dynamics(signals.q, signals.dq, signals.ddq)


def only(notes, *words):
    assert len(notes) >= 1, notes
    for word in words:
        assert any(word in note for note in notes), notes


def test_nothing_wrong(signals, torque):
    assert suspicions(signals, torque, ROBOT) == []


def test_degrees(signals, torque):
    degrees = signals.with_(q=np.rad2deg(signals.q))
    only(suspicions(degrees, torque, ROBOT), "looks like degrees", "degrees and rad mixed")


def test_milliseconds(signals, torque):
    only(suspicions(signals.with_(time=signals.time * 1e3), torque, ROBOT), "time in ms")


def test_currents(signals, torque):
    only(suspicions(signals, torque * 0.05, ROBOT), "currents instead of torques")


def test_repeats(signals, torque):
    held = np.arange(len(signals.q)) // 2 * 2
    repeated = signals.with_(q=signals.q[held], dq=signals.dq[held])
    only(suspicions(repeated, torque, ROBOT), "polled faster")


def test_saturation(signals, torque):
    limit = 0.8 * np.abs(torque[:, 0]).max()
    cut = np.column_stack([np.clip(torque[:, 0], -limit, limit), torque[:, 1]])
    only(suspicions(signals, cut, ROBOT), "saturated", "joint 1")


def test_still_joint(signals, torque):
    still = signals.with_(q=signals.q * [1, 0], dq=signals.dq * [1, 0])
    only(suspicions(still, torque, ROBOT), "Joint 2")
