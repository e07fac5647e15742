# SPDX-License-Identifier: BSD-3-Clause
"""What fits of the readings of a log are not deceived by."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn.measurement import Measurement
from skidyn.measurement._reading import Reading


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_wrong_masses_of_the_description_support_no_reading(factor, arm, short, told_of):
    bodies = np.asarray(arm.inertial_parameters, dtype=float).reshape(-1, 10).copy()
    bodies[1] *= factor
    assert "reading" not in told_of(short, replace(arm, inertial_parameters=bodies))


def test_rows_that_no_reading_explains_do_not_hide_a_sign(short, told_of):
    """A tenth of the torque is far off, such as by contacts."""
    rng = np.random.default_rng(0)
    off = rng.random(len(short)) < 0.1
    torque = -short["tau2"] + 20.0 * short["tau2"].std() * off * rng.normal(size=len(short))
    told = told_of(short.assign(tau2=torque))["reading"]
    assert told.joints == (2,) and told.remedy.option == "--flip tau2"


def test_a_slower_clock_does_not_blur_the_sign_of_friction(arm, signals):
    """Without gravity no rate can be known, however wide the friction reverses."""
    floating = replace(arm, gravity=np.zeros(3))
    rigid = floating.inverse_dynamics(signals.q, signals.dq, signals.ddq)
    noise = np.random.default_rng(0).normal(0, 0.05, signals.q.shape)
    torque = rigid + 4.0 * np.tanh(signals.dq / 0.4) + noise
    fits = Measurement(signals, torque, floating, ("shoulder", "elbow")).fits
    here, there = (fits.nominal(Reading(stretch=rate)) for rate in (1.0, 0.1))
    np.testing.assert_allclose(there.margin(here), 0.0, atol=0.5)
    here, there = (fits.identified(Reading(stretch=rate)) for rate in (1.0, 0.1))
    np.testing.assert_allclose(there.margin(here), 0.0, atol=0.5)
