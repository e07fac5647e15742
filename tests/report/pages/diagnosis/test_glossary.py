# SPDX-License-Identifier: BSD-3-Clause
"""Terms of the page of a diagnosis."""


def test_words_of_the_page_are_explained(diagnosis_page):
    shown = diagnosis_page["glossary"]
    assert "residual Measured minus modelled torque." in shown
    assert "held-out error" in shown
