# SPDX-License-Identifier: BSD-3-Clause
"""A motion with all that effects are made from."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.effects import Signals, get_effect


@pytest.fixture(scope="session")
def robot():
    return load_planar_arm()


@pytest.fixture
def signals(robot):
    t = np.arange(0, 6, 0.01)
    phase = np.column_stack([1.3 * t, 2.1 * t])
    rates = np.array([1.3, 2.1])
    return Signals(
        0.5 * np.sin(phase),
        0.5 * rates * np.cos(phase),
        -0.5 * rates**2 * np.sin(phase),
        trajectory=np.repeat([0, 1], 300),
        time=t,
        temperature=np.column_stack([30 + t, 40 - t]),
        robot=robot,
        load=np.column_stack([np.cos(t), np.sin(t)]),
        model_torque=np.column_stack([np.sin(3 * t), np.cos(3 * t)]),
    )


@pytest.fixture(scope="session")
def columns_of():
    """Columns of a kind on one joint."""

    def columns(kind, signals, joint=0, **shape):
        return get_effect(kind).columns(signals, joint, **shape)

    return columns


@pytest.fixture(scope="session")
def left_by():
    """Share of the size of a torque that columns cannot take."""

    def left(columns, torque):
        fit = columns @ np.linalg.lstsq(columns, torque, rcond=None)[0]
        return float(np.std(torque - fit) / np.std(torque))

    return left
