# SPDX-License-Identifier: BSD-3-Clause
"""Moments at which an effect may begin."""

import numpy as np

from skidyn.effects import starts
from skidyn.effects._moments import moments


def test_are_starts_of_recordings_where_one_is_close(signals):
    assert starts(signals).tolist() == [3.0]

    np.testing.assert_allclose(moments(signals, 4), [1.2, 3.0, 4.8])
    np.testing.assert_allclose(moments(signals, 5), [1.0, 2.0, 3.0, 4.0, 5.0])


def test_a_clock_that_begins_anew_does_not_order_recordings(signals):
    again = signals.with_(time=np.tile(np.arange(0, 3, 0.01), 2))
    assert not len(starts(again))
