# SPDX-License-Identifier: BSD-3-Clause
"""The one table of skidyn's public API: which page tells of what, and in which order.

The API pages are generated from it, and ``tests/test_public_api.py`` checks that every public
symbol is in it exactly once.
"""

from typing import NamedTuple


class Section(NamedTuple):
    """Some symbols of a module that belong together."""

    title: str
    names: tuple[str, ...]


class Page(NamedTuple):
    """The page of one module; the sentence says what a reader finds in it."""

    module: str
    sentence: str
    sections: tuple[Section, ...]


PAGES: tuple[Page, ...] = (
    Page("skidyn", "What the package itself offers.", (Section("Versions", ("show_versions",)),)),
)
