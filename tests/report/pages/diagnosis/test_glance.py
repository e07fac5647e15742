# SPDX-License-Identifier: BSD-3-Clause
"""The first screen of a diagnosis."""


def test_what_is_missing_and_how_large_it_is(diagnosis_page):
    shown = diagnosis_page["verdict"]
    assert "Missing: Dahl friction on joints 1 and 2 and spring on joint 3" in shown
    assert "Fc = 3.00 ± 0.10 (joint 1)" in shown
    assert "One trajectory has 3 repeated rows" in shown
