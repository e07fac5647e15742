# SPDX-License-Identifier: BSD-3-Clause
"""What fits of the readings of a log are not deceived by."""

from dataclasses import replace

import numpy as np
import pytest


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
