# SPDX-License-Identifier: BSD-3-Clause
"""An effect that is there improves the simulated motion."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor
from skidyn.simulation import simulate


@pytest.mark.parametrize(
    "kind",
    [
        "dahl",
        "time_delay",
        *(
            pytest.param(kind, marks=pytest.mark.slow)
            for kind in ("load_dependent_friction", "backlash")
        ),
    ],
)
def test_effect_that_is_there_improves_the_motion(kind):
    log = make_hidden_effect_log(
        load_planar_arm(), kind, joints=[1], n_trajectories=4, duration=5.0
    )
    train = log.frame["trajectory"] <= 3
    plain = RBDRegressor(log.robot).fit(log.X[train], log.y[train])
    whole = plain.with_effects([(kind, [1])]).fit(log.X[train], log.y[train])
    errors = [
        np.sqrt(np.nanmean((out["q1"] - log.X["q1"][~train]) ** 2))
        for out in (simulate(m, log.X[~train], log.y[~train], horizon=1.0) for m in (plain, whole))
    ]
    assert errors[1] < 0.8 * errors[0]


def test_what_cannot_be_simulated_is_refused():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=1, duration=2.0)
    model = RBDRegressor(log.robot)
    with pytest.raises(SkidynError, match="no fitted robot"):
        simulate(model, log.X, log.y)
    model.fit(log.X, log.y)
    with pytest.raises(SkidynError, match="y has 199 rows and X 200"):
        simulate(model, log.X, log.y[:199])
    with pytest.raises(SkidynError, match="step=0"):
        simulate(model, log.X, log.y, step=0)
    with pytest.raises(SkidynError, match="another order than the joints"):
        simulate(model, log.X, log.frame[["tau2", "tau1"]])
