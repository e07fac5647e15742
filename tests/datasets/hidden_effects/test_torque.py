# SPDX-License-Identifier: BSD-3-Clause
"""Simulated torques have their formulas."""

import numpy as np

from skidyn.datasets import load_planar_arm, make_hidden_effect_log

ARM = load_planar_arm()
SHORT = {"n_trajectories": 2, "duration": 3.0, "noise": 0.0}


def added(kind, **options):
    """A noiseless log with an effect, and its torque less that of the same log without."""
    log = make_hidden_effect_log(ARM, kind, **SHORT, **options)
    return log, log.y - make_hidden_effect_log(ARM, None, base=log.base, **SHORT).y


def test_an_offset_is_the_same_at_every_sample():
    log, torque = added("offset", joints=[1])
    np.testing.assert_allclose(torque[:, 0], float(np.ravel(log.parameters["tau0"])[0]), atol=1e-9)
    np.testing.assert_allclose(torque[:, 1], 0.0, atol=1e-9)


def test_a_ripple_repeats_with_its_waves_and_size():
    log, torque = added("torque_ripple", joints=[2])
    size, waves = (float(np.ravel(log.parameters[name])[0]) for name in ("A", "N"))
    q = log.frame["q2"].to_numpy()
    basis = np.column_stack([np.sin(waves * q), np.cos(waves * q)])
    parts, *_ = np.linalg.lstsq(basis, torque[:, 1], rcond=None)
    np.testing.assert_allclose(np.hypot(*parts), size, rtol=1e-3)
