# SPDX-License-Identifier: BSD-3-Clause
"""Simulated friction has its formula."""

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


def test_viscous_and_spring_have_their_formula():
    log, torque = difference(PLANAR, "viscous", joints=[2])
    np.testing.assert_allclose(torque[:, 1], log.parameters["Fv"][0] * log.frame["dq2"], atol=1e-9)
    log, torque = difference(PLANAR, "spring", joints=[1])
    k, q0 = log.parameters["k"][0], log.parameters["q0"][0]
    np.testing.assert_allclose(torque[:, 0], k * (log.frame["q1"] - q0), atol=1e-3 * k)
