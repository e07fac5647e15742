# SPDX-License-Identifier: BSD-3-Clause
"""What a diagnosis says agrees with what it has measured."""

import numpy as np


def test_the_history_is_that_of_both_comparisons(missing):
    first, last = missing.history[0], missing.history[-1]
    np.testing.assert_array_equal(first["rmse"], missing.comparison.rmse(judged=True))
    np.testing.assert_array_equal(last["rmse"], missing.comparison_after.rmse(judged=True))
    assert [step["added"] for step in missing.history] == [None, "spring"]


def test_a_finding_removes_what_it_says(missing):
    (finding,) = missing.findings
    before, after = missing.rmse_before[1], missing.rmse_after[1]
    assert finding.error_drop == 1 - (after / before) ** 2


def test_verdicts(missing, complete):
    assert (missing.verdict, missing.unexplained) == ("missing", None)
    assert (complete.verdict, complete.findings) == ("complete", [])
