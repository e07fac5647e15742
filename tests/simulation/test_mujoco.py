# SPDX-License-Identifier: BSD-3-Clause
"""What MuJoCo cannot hold is said."""

import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor
from skidyn.simulation import simulate


def test_mujoco_says_what_it_cannot_hold():
    pytest.importorskip("mujoco")
    log = make_hidden_effect_log(load_planar_arm(), "dahl", joints=[1], n_trajectories=2)
    model = RBDRegressor(log.robot, ["viscous", ("dahl", [1])]).fit(log.X, log.y)
    with pytest.raises(SkidynError, match="dahl of joint1"):
        simulate(model, log.X, log.y, engine="mujoco")
