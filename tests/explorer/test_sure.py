# SPDX-License-Identifier: BSD-3-Clause
"""How sure the name of an addition is."""

from __future__ import annotations


def test_a_name_that_another_effect_beats_is_not_sure(session):
    session.add("offset", joint=2)
    assert session.sure() == ["low confidence: spring removes more of the error"]


def test_a_name_far_ahead_of_all_others_is_surer_than_one_among_equals(session):
    session.add("spring", joint=2)
    (sure,) = session.sure()
    session.undo()
    session.add("gravity_compensator", joint=2)
    (other,) = session.sure()
    assert sure.startswith("confidence ") and other.startswith("low confidence")
