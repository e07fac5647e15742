# SPDX-License-Identifier: BSD-3-Clause
import html
import re
from pathlib import Path

from skidyn.report import render_html, summarize, summarize_fleet

DOCS = Path(__file__).parents[2] / "docs" / "user_guide" / "glossary.rst"


def test_the_documentation_and_the_pages_explain_the_same_words(fakes):
    text = DOCS.read_text("utf-8")
    explained = set()
    for summary in (summarize(fakes.make_diagnosis()), summarize_fleet(fakes.make_fleet())):
        page = html.unescape(render_html(summary))
        for word, meaning in re.findall(r"<dt><dfn>(.*?)</dfn></dt><dd>(.*?)</dd>", page):
            explained.add(word)
            assert f"   {word}\n      {meaning}\n" in text
    assert set(re.findall(r"^   (\w.*)\n      ", text, re.MULTILINE)) == explained
