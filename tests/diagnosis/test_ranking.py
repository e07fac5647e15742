# SPDX-License-Identifier: BSD-3-Clause
"""Explanations in the order of what they do."""


def test_the_first_of_a_ranking_was_added_and_rivals_score_less(missing):
    first = missing.result.findings[0]
    assert first.kind == "spring"
    assert all(other.kind != "spring" for other in first.others)
    rivals = [h.score for h in first.others if h.joints == first.joints]
    assert not rivals or max(rivals) < first.score
