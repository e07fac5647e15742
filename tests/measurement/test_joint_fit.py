# SPDX-License-Identifier: BSD-3-Clause
"""Lags of torques at which all joints together are explained best."""

import numpy as np
import pytest

from skidyn.measurement import Measurement
from skidyn.measurement._joint_fit import JointFit, lag_gain, refined_lag


@pytest.fixture(scope="module")
def rows(arm, signals, torque):
    """Rows in which the torque of the second joint is late by some time, s."""

    def made(lag):
        late = torque.copy()
        late[:, 1] = np.interp(signals.time - lag, signals.time, torque[:, 1])
        return Measurement(signals, late, arm, ("shoulder", "elbow")).fits

    return made


def test_the_lag_of_one_joint_is_refined(rows):
    in_time, late = (refined_lag(rows(lag), lag, 0.01, [1]) for lag in (0.0, 0.02))
    assert late - in_time == pytest.approx(0.02, abs=1e-3)
    assert lag_gain(rows(0.02), 0.02, [1]) > max(0.0, lag_gain(rows(0.02), 0.02, [0]))


def test_a_lag_far_from_its_start_is_not_taken(rows):
    assert refined_lag(rows(0.02), 0.012, 1e-4, [1]) == 0.012


def test_the_residual_of_the_samples_is_that_of_the_rows(rows):
    late = rows(0.02)
    together = JointFit(late, [0, 1])
    fitted = together.fit_at(0.02)
    left = late.average(together.left(late.torque_at(0.02), fitted))
    for column, (fit, use) in enumerate(zip(fitted, together.rows, strict=True)):
        np.testing.assert_allclose(left[use, column], fit.residual, atol=1e-9)
