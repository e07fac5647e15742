# SPDX-License-Identifier: BSD-3-Clause
"""Two diagnoses on which several tests look: a spring is missing, and nothing is."""

import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


@pytest.fixture(scope="session")
def spring_log():
    return make_hidden_effect_log(load_planar_arm(), "spring", joints=[2])


@pytest.fixture(scope="session")
def missing(spring_log):
    return diagnose(RBDRegressor(spring_log.robot), spring_log.X, spring_log.y)


@pytest.fixture(scope="session")
def complete():
    log = make_hidden_effect_log(load_planar_arm(), None)
    return diagnose(RBDRegressor(log.robot), log.X, log.y)
