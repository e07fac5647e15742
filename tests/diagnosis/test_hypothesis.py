# SPDX-License-Identifier: BSD-3-Clause
"""Explanations that a search has compared."""


def test_the_best_explanation_is_the_finding(missing):
    (hypothesis,) = missing.result.findings
    assert (hypothesis.kind, hypothesis.joints, hypothesis.variables) == ("spring", (1,), ())
    assert hypothesis.score < hypothesis.gain.sum()  # its parameters are paid for
    assert 0 <= hypothesis.margin <= 1 and max(hypothesis.chances) < 1e-6
    assert hypothesis.tried > 100
