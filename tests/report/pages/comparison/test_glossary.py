# SPDX-License-Identifier: BSD-3-Clause
"""Terms of the page of a comparison."""


def test_words_are_those_of_a_diagnosis(comparison_page, diagnosis_page):
    assert comparison_page["glossary"] == diagnosis_page["glossary"]
