# SPDX-License-Identifier: BSD-3-Clause
"""Noise of coarse positions is no effect, and does not hide one."""

import warnings

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor

#: Step of an encoder of 12 bits, rad.
STEP = 2 * np.pi / 2**12


def diagnosis_of(effect, seed, rate=100.0, **options):
    log = make_hidden_effect_log(
        load_planar_arm(), effect, noise="low", rate=rate, random_state=seed, **options
    )
    X = log.X.copy()
    for name in ("q1", "q2"):
        X[name] = np.round(X[name] / STEP) * STEP
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return diagnose(RBDRegressor(log.robot), X, log.y, checks=())


def test_rounded_positions_are_no_payload():
    """The rounding of slow recordings looks like a load that others do not have."""
    diagnosis = diagnosis_of(None, 114010)

    assert diagnosis.verdict == "complete"
    assert not diagnosis.findings


@pytest.mark.parametrize(("rate", "seed"), [(500.0, 9), (1000.0, 2)])
def test_coarse_positions_of_a_fast_log_are_neither_hysteresis_nor_pushes(rate, seed):
    """They are looked at near reversals and in short windows, and make bursts in slow motion."""
    diagnosis = diagnosis_of(None, seed, rate=rate, n_trajectories=8, duration=5.0)

    assert diagnosis.verdict == "complete"
    assert not diagnosis.findings


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["stribeck", "spring", "payload"])
def test_what_exceeds_the_noise_of_coarse_positions_is_found(effect):
    joints = None if effect == "payload" else [2]
    diagnosis = diagnosis_of(effect, 7, joints=joints)

    assert {f.kind for f in diagnosis.findings} == {effect}
