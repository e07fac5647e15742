# SPDX-License-Identifier: BSD-3-Clause
"""Smoothers tell their error on samples left out."""

import numpy as np
import pandas as pd
import pytest

from skidyn.preprocessing import SmoothDerivatives

W = 2 * np.pi * np.array([0.3, 0.7, 1.1])
#: A quarter of the samples at each end is not judged.
N, RATE = 416, 200.0


@pytest.mark.parametrize("method", ["butterworth", "kalman", "savitzky_golay"])
def test_left_out_error_is_that_of_leaving_each_sample_out(method):
    """The shortcut by the sample's own weight is exact for the Kalman smoother, near for others."""
    t = np.arange(N) / RATE
    q = np.sin(t[:, None] * W).sum(axis=1) + 1e-2 * np.random.default_rng(0).normal(size=N)
    table = SmoothDerivatives(["q1"], method=method).fit(pd.DataFrame({"time": t, "q1": q}))
    tried = pd.DataFrame(table.cv_results_)
    own = tried.iloc[(tried["cutoff"] - 6.0).abs().argmin()]

    # a column per sample that is left out, which gets the value that its neighbours predict
    judged = np.arange(N // 4, N - N // 4)
    names = [f"q{k}" for k in judged]
    log = pd.DataFrame(np.tile(q[:, None], len(judged)), columns=names)
    smooth = SmoothDerivatives(names, method=method, cutoff=own["cutoff"], rate=RATE)
    smooth.set_output(transform="pandas")
    at = judged, np.arange(len(judged))
    for _ in range(20):
        values = log.to_numpy(copy=True)
        values[at] = smooth.fit_transform(log)[names].to_numpy()[at]
        log = pd.DataFrame(values, columns=names)
    left_out = np.mean((q[judged] - log.to_numpy()[at]) ** 2)
    assert own["error"] == pytest.approx(left_out, rel=1e-6)
