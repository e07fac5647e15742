# SPDX-License-Identifier: BSD-3-Clause
"""Simulated elasticity and play."""

import numpy as np

from skidyn.datasets import load_planar_arm, load_scara, make_hidden_effect_log

PLANAR, SCARA = load_planar_arm(), load_scara()
SHORT = {"n_trajectories": 4, "duration": 4.0}


def difference(robot, effect, **options):
    """Torque of an effect: a noiseless log with it less one without."""
    with_effect = make_hidden_effect_log(robot, effect, noise=0.0, **SHORT, **options)
    base = with_effect.base
    without = make_hidden_effect_log(robot, None, noise=0.0, base=base, **SHORT)
    return with_effect, with_effect.y - without.y


def test_elastic_joint_reports_the_motor_position():
    log = make_hidden_effect_log(
        PLANAR, "joint_elasticity", joints=[1], noise=0.0, base=(), **SHORT
    )
    rigid = make_hidden_effect_log(PLANAR, None, noise=0.0, base=(), **SHORT)
    np.testing.assert_allclose(log.y, rigid.y, atol=1e-9)
    twist = (log.frame["q1"] - rigid.frame["q1"]).to_numpy()
    np.testing.assert_allclose(twist, log.y[:, 0] / log.parameters["K"][0], atol=1e-4)


def test_backlash_lets_the_link_fly_between_the_flanks():
    log, torque = difference(PLANAR, "backlash", joints=[1], base=())
    flying = np.abs(log.y[:, 0]) < 1e-3 * np.abs(log.y[:, 0]).max()
    assert 0.002 < flying.mean() < 0.5
    assert np.abs(torque[:, 0].mean()) < 0.2 * torque[:, 0].std()
