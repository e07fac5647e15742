# SPDX-License-Identifier: BSD-3-Clause
"""A card for every finding."""


def test_a_card_holds_rivals_the_motion_that_separates_and_the_code(diagnosis_page):
    shown = diagnosis_page["what"]
    assert "This data cannot separate it from LuGre friction or Stribeck friction" in shown
    assert "slow sweeps with small reversals, below 0.02 rad would separate them" in shown
    assert "diagnosis.add(&#34;dahl&#34;, joints=[1, 2])" in shown
