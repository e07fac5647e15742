# SPDX-License-Identifier: BSD-3-Clause
"""What sensors and logger make of a simulated motion."""

import numpy as np


def test_positions_have_the_steps_of_the_encoder_and_time_those_of_the_clock(empty):
    sensors = empty.truth["sensors"]
    assert sensors["bits"] == 18 and not sensors["irregular"]
    step = 2 * np.pi / 2**18
    for name in ("q1", "q2"):
        counts = empty.frame[name].to_numpy() / step
        np.testing.assert_allclose(counts, np.rint(counts), atol=1e-6)
    for _, run in empty.frame.groupby("trajectory"):
        np.testing.assert_allclose(np.diff(run["time"]), 1 / empty.truth["rate"], atol=1e-6)
