# SPDX-License-Identifier: BSD-3-Clause
"""Curves of two diagnoses in one picture."""

import numpy as np
import pytest

from skidyn.report import summarize_comparison


def two_logs(fakes):
    second = fakes.make_diagnosis(n_samples=1500)
    second.findings = second.findings[:1]
    return fakes.make_diagnosis(), second


def test_two_logs_keep_their_own_times(fakes):
    summary = summarize_comparison(*two_logs(fakes), names=("new", "worn"))
    assert not summary["report"]["same_log"]
    assert [len(tables) for tables in summary["time"]["joints"]] == [2, 2, 2]
    assert summary["time"]["starts"] == []  # the borders of one are not those of the other
    found = {(tuple(f["kinds"]), f["joint"]): f["in"] for f in summary["report"]["findings"]}
    assert found == {
        (("spring",), 3): ["new"], (("dahl",), 1): ["new", "worn"], (("dahl",), 2): ["new", "worn"],
    }  # fmt: skip


def test_curves_are_those_of_the_residual(fakes):
    summary = summarize_comparison(*two_logs(fakes))
    curve = next(o for o in summary["residuals"] if o["variable"] == "dq1")
    median = np.array(curve["sides"][0]["median"], dtype=float)
    x = np.array(curve["x"])
    known = np.isfinite(median) & (np.abs(x) > 0.1)
    assert median[known] == pytest.approx(3 * np.sign(x[known]), abs=0.3)
