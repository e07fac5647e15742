# SPDX-License-Identifier: BSD-3-Clause
"""Averaged rows of a measurement."""

import numpy as np

from skidyn.measurement import Measurement


def test_rows_of_a_torque_are_its_means(arm, signals, torque):
    fits = Measurement(signals, torque, arm, ("shoulder", "elbow")).fits
    rows = fits.average(fits.signals.clock)
    assert np.all(np.diff(rows) > 0) and fits.moving.shape == (fits.n_rows, 2)
    smooth = np.interp(rows, signals.time, torque[:, 0])
    assert np.corrcoef(fits.mean_torque(0)[0], smooth)[0, 1] > 0.99


def test_recordings_that_are_too_short_have_no_rows(arm, signals, torque):
    few = slice(0, 150)
    short = signals.take(few)
    assert Measurement(short, torque[few], arm, ("shoulder", "elbow")).fits is None
