# SPDX-License-Identifier: BSD-3-Clause
"""Torque over time, thinned."""

import numpy as np
import pytest

from skidyn.report import summarize


def test_trajectories_are_laid_end_to_end(fakes):
    trace = summarize(fakes.make_diagnosis())["time"]["traces"][0]
    assert [start["trajectory"] for start in trace["starts"]] == [0, 1, 2]
    assert [start["time"] for start in trace["starts"]] == pytest.approx([0, 10, 20], rel=0.02)
    # a line that goes on over a border would be drawn up or down
    assert trace["starts"][1]["time"] - 9.99 > 0.003 * 30
    assert (np.diff(trace["time"]) > 0).all()
    assert len(trace["breaks"]) == 2


def test_long_logs_are_thinned_without_losing_the_largest_residual(fakes):
    diagnosis = fakes.make_diagnosis(n_samples=300_000)
    trace = summarize(diagnosis)["time"]["traces"][0]
    assert len(trace["time"]) < 25_000
    residual = np.subtract(trace["columns"]["measured"], trace["columns"]["before"])
    whole = diagnosis.comparison.residual[:, 0]
    assert residual.max() == pytest.approx(whole.max())
    assert residual.min() == pytest.approx(whole.min())
