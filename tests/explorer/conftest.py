# SPDX-License-Identifier: BSD-3-Clause
"""A session on a log that hides a spring on joint 2."""

from __future__ import annotations

import copy

import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.explorer import Session
from skidyn.identification import RBDRegressor


@pytest.fixture(scope="session")
def log():
    return make_hidden_effect_log(load_planar_arm(), "spring", joints=[2], n_trajectories=8)


@pytest.fixture(scope="session")
def started(log):
    """A session with its first rankings, which each test would otherwise compute again."""
    session = Session(RBDRegressor(log.robot), log.X, log.y)
    for joint in (1, 2):
        session.ranked(joint)
    return session


@pytest.fixture
def session(started):
    return copy.deepcopy(started)
