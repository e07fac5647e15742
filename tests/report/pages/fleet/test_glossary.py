# SPDX-License-Identifier: BSD-3-Clause
"""Terms of the page of a fleet."""


def test_words_of_this_page_alone(fleet_page):
    assert (
        "scatter The standard deviation of a coefficient between normal robots"
        in (fleet_page["glossary"])
    )
    assert "reversal" not in fleet_page["glossary"]
