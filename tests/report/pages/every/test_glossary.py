# SPDX-License-Identifier: BSD-3-Clause
"""Terms at the end of a page."""


def test_words_of_the_page_are_explained(diagnosis_page):
    shown = diagnosis_page["glossary"]
    assert "residual Measured minus modelled torque." in shown
    assert "held-out error" in shown


def test_words_of_a_comparison_are_those_of_a_diagnosis(comparison_page, diagnosis_page):
    assert comparison_page["glossary"] == diagnosis_page["glossary"]


def test_a_fleet_has_words_of_its_own_alone(fleet_page):
    assert (
        "scatter The standard deviation of a coefficient between normal robots"
        in fleet_page["glossary"]
    )
    assert "reversal" not in fleet_page["glossary"]
