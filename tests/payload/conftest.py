# SPDX-License-Identifier: BSD-3-Clause
"""A payload that a UR5 carries in some recordings, and what is found of it."""

import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.payload import identify_payload

FRICTION = ("viscous", "coulomb")


@pytest.fixture(scope="session")
def runs():
    """A log of a UR5 that carries a payload in some trajectories: loaded, unloaded, the truth."""
    log = make_hidden_effect_log(
        load_ur5(), "payload", base=FRICTION, n_trajectories=6, duration=8.0, random_state=3
    )
    carries = log.frame["trajectory"].isin(log.parameters["trajectories"])
    return log, log.frame[carries], log.frame[~carries]


@pytest.fixture(scope="session")
def found(runs):
    log, loaded, unloaded = runs
    return identify_payload(log.robot, loaded, unloaded, effects=FRICTION)
