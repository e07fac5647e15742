# SPDX-License-Identifier: BSD-3-Clause
"""What a simulation needs to be told."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor
from skidyn.simulation import Controller, simulate


def test_bad_input_is_told():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=1, duration=2.0)
    model = RBDRegressor(log.robot).fit(log.X, log.y)
    with pytest.raises(SkidynError, match="torque y or a controller"):
        simulate(model, log.X)
    with pytest.raises(SkidynError, match="q_ref1"):
        simulate(model, log.X, controller=Controller(1.0))
    with pytest.raises(SkidynError, match="stiffness"):
        simulate(model, log.X.assign(q_ref1=0.0, q_ref2=0.0), controller=Controller(-1.0))
    with pytest.raises(SkidynError, match="horizon"):
        simulate(model, log.X, log.y, horizon=0)
    with pytest.raises(SkidynError, match="row 7"):
        simulate(model, log.X, np.where(np.arange(len(log.y))[:, None] == 7, np.nan, log.y))
    with pytest.raises(SkidynError, match="engine"):
        simulate(model, log.X, log.y, engine="bullet")
