# SPDX-License-Identifier: BSD-3-Clause
from pathlib import Path

from skidyn.report import render_html, summarize
from skidyn.report._glossary import FLEET_MEANINGS, MEANINGS, meaning

DOCS = Path(__file__).parents[2] / "docs" / "user_guide" / "glossary.rst"


def test_a_word_may_begin_a_sentence():
    assert meaning("Held-out error") == meaning("held-out error")


def test_the_page_explains_every_word(fakes):
    page = render_html(summarize(fakes.make_diagnosis()))
    for word in MEANINGS:
        assert f"<dfn>{word}</dfn>" in page


def test_the_documentation_says_the_same():
    text = DOCS.read_text("utf-8")
    for word in (*MEANINGS, *FLEET_MEANINGS):
        assert f"   {word}\n      {meaning(word)}\n" in text
