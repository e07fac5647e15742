# SPDX-License-Identifier: BSD-3-Clause
"""What MuJoCo cannot hold is said."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import Term
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor
from skidyn.simulation import simulate


def test_mujoco_says_what_it_cannot_hold():
    pytest.importorskip("mujoco")
    log = make_hidden_effect_log(load_planar_arm(), "dahl", joints=[1], n_trajectories=2)
    model = RBDRegressor(log.robot, ["viscous", ("dahl", [1])]).fit(log.X, log.y)
    with pytest.raises(SkidynError, match="dahl of joint1"):
        simulate(model, log.X, log.y, engine="mujoco")


def test_gears_that_are_not_rigid_are_refused_by_name():
    pytest.importorskip("mujoco")
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2)
    model = RBDRegressor(log.robot, ["rotor_inertia"], consistent=True).fit(log.X, log.y)
    soft = Term("joint_elasticity", (1,), {"resonance": 10.0, "damping": 0.1})
    model.effect_terms_ = type(model.effect_terms_)([*model.effect_terms_, soft])
    model.effect_coefficients_[soft] = np.array([1e-3])
    with pytest.raises(SkidynError, match="joint_elasticity"):
        simulate(model, log.X, log.y, engine="mujoco")
