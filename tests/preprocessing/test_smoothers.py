# SPDX-License-Identifier: BSD-3-Clause
"""Smoothers tell their error on samples left out."""

import numpy as np
import pandas as pd
import pytest

from skidyn.preprocessing._smoothers import SMOOTHERS

W = 2 * np.pi * np.array([0.3, 0.7, 1.1])


def motion(t, order=0):
    phase = t[:, None] * W + order * np.pi / 2
    return (W**order * np.sin(phase)).sum(axis=1)


def record(noise, rate=200.0, seconds=15.0, jitter=0.0):
    rng = np.random.default_rng(0)
    t = np.arange(int(rate * seconds)) / rate
    t = t + jitter / rate * rng.uniform(-0.5, 0.5, t.size)
    return pd.DataFrame({"time": t, "q1": motion(t) + noise * rng.normal(size=t.size)})


@pytest.mark.parametrize("method", sorted(SMOOTHERS))
def test_left_out_error_is_that_of_leaving_a_sample_out(method):
    """The shortcut by the sample's own weight is exact for the Kalman smoother, near for others."""
    log = record(1e-2, seconds=2.0)
    t, q = log["time"].to_numpy(), log[["q1"]].to_numpy()
    shortcut = SMOOTHERS[method](t, q, 6.0).left_out_error(q)[200, 0]
    for _ in range(60):  # the value at which a sample agrees with its own prediction
        q = q.copy()
        q[200] = SMOOTHERS[method](t, q, 6.0).value[200]
    measured = log["q1"][200] - q[200, 0]
    assert shortcut == pytest.approx(measured, rel=1e-6)
