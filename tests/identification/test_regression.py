# SPDX-License-Identifier: BSD-3-Clause
"""Standard errors from folds left out."""

from __future__ import annotations

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.identification import RBDRegressor

FRICTION = ("viscous", "coulomb")


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(
        load_planar_arm(), None, base=FRICTION, n_trajectories=12, duration=6.0, random_state=2
    )


@pytest.fixture(scope="module")
def new(log):
    """Which samples belong to the trajectories that no model sees."""
    return (log.frame["trajectory"] > 8).to_numpy()


@pytest.fixture(scope="module")
def model(log, new):
    return RBDRegressor(log.robot).fit(log.X[~new], log.y[~new])


def test_standard_deviation_is_that_of_the_errors(log, new, model):
    torque, std = model.predict(log.X[new], return_std=True)
    np.testing.assert_array_equal(torque, model.predict(log.X[new]))
    rms = np.sqrt(np.mean((torque - np.asarray(log.y)[new]) ** 2, axis=0))
    np.testing.assert_allclose(np.sqrt(np.mean(std**2, axis=0)), rms, rtol=0.35)
