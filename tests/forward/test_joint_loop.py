# SPDX-License-Identifier: BSD-3-Clause
"""A joint alone in its loop moves as the whole model does."""

from functools import cache

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.forward import Controller, JointLoop, read_task
from skidyn.identification import RBDRegressor
from skidyn.simulation import simulate

SIZES = {"viscous": (0.4, 0.03), "coulomb": (0.8, 0.06)}


@cache
def loop_of(**limits):
    """Joint 2 of a planar arm whose motion is that of the model, and its positions."""
    servo = Controller((200.0, 12.0), (12.0, 0.6), follows_velocity=False, **limits)
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=2.0)
    model = RBDRegressor(log.robot, ("viscous", "coulomb"), "nominal").fit(log.X, log.y)
    for term in model.effect_terms_:
        model.effect_coefficients_[term] = np.array([SIZES[term.kind][term.places[0]]])
    wanted = log.X.assign(q_ref1=log.X["q1"], q_ref2=log.X["q2"])
    moved = simulate(model, wanted, controller=servo)
    task = read_task(model, moved.drop(columns=["ddq1", "ddq2"]), None, servo, 2.0)
    s = task.signals
    still, turn = np.zeros_like(s.q), np.tile([0.0, 1.0], (len(s.q), 1))
    own = log.robot.inverse_dynamics(s.q, still, turn, gravity=(0.0, 0.0, 0.0))[:, 1]
    rigid = log.robot.inverse_dynamics(s.q, s.dq, s.ddq)[:, 1]
    return JointLoop.of(task, 1, own, rigid - own * s.ddq[:, 1], rigid)


FRICTION = {"viscous": np.array([0.03]), "coulomb": np.array([0.06])}


@pytest.mark.slow
@pytest.mark.parametrize("words", [{}, {"limit": 1.0}, {"limit": 1.5, "no_load_speed": 6.0}])
def test_a_joint_follows_the_whole_model(words):
    loop = loop_of(**words)
    error = loop.errors(FRICTION)[0]
    assert np.sqrt(np.mean(error[loop.valid] ** 2)) < 3e-4
    without = loop.errors({k: 0 * v for k, v in FRICTION.items()})[0]
    assert np.sqrt(np.mean(without[loop.valid] ** 2)) > 2e-3


def test_a_stiff_gear_is_none_and_play_moves_the_motor():
    loop = loop_of()
    plain = loop.run(FRICTION)[0]
    gear = {**FRICTION, "compliance": np.array([1e-4]), "motor": np.array([0.3])}
    np.testing.assert_allclose(loop.run(gear)[0][loop.valid], plain[loop.valid], atol=5e-4)
    loose = loop.run({**gear, "gap": np.array([0.02])})[0]
    assert np.abs(loose - plain)[loop.valid].max() > 1e-3


def test_models_side_by_side_are_those_one_by_one():
    loop = loop_of()
    values = {
        "viscous": np.array([0.03, 0.05]),
        "coulomb": np.array([0.06, 0.01]),
        "dF": np.array([0.0, 0.1]),
        "vs": np.array([0.1, 0.1]),
        "late": np.array([0.0, 0.01]),
    }
    both = loop.run(values)
    for k in range(2):
        alone = loop.run({name: value[[k]] for name, value in values.items()})[0]
        np.testing.assert_allclose(both[k], alone, atol=1e-12)
    part = loop.only(np.array([1]))
    np.testing.assert_allclose(part.run(values), both[:, :, [1]], atol=1e-12)
