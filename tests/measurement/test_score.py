# SPDX-License-Identifier: BSD-3-Clause
"""What a column promises beside a fit of all joints."""

import numpy as np
import pytest

from skidyn._signals import Signals
from skidyn.measurement import Measurement
from skidyn.measurement._score import Score


@pytest.fixture(scope="module")
def score(arm, signals, torque):
    assert isinstance(signals, Signals)
    return Score(Measurement(signals, torque, arm, ("shoulder", "elbow")).fits)


def test_a_column_that_bodies_follow_promises_nothing(score):
    column = np.zeros((score.fits.n_rows, 2))
    column[:, 0] = score.fits.average(score.fits.signals.ddq)[:, 0]  # a rotor of the first joint
    assert score.promise(column)[0] < 10


def test_a_torque_that_was_added_is_promised_with_its_size(arm, signals, torque):
    beats = np.sign(np.sin(7.0 * signals.time))
    added = torque + 0.5 * beats[:, None] * [0, 1]
    found = Score(Measurement(signals, added, arm, ("shoulder", "elbow")).fits)
    column = found.fits.average(np.sign(np.sin(7.0 * found.fits.signals.clock)))
    gain, size = found.promise(column[:, None] * [0, 1])
    assert gain > 15 and size == pytest.approx(0.5, abs=0.15)
