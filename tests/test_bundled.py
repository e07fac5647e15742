# SPDX-License-Identifier: BSD-3-Clause
"""What the pages carry."""

import pytest

from skidyn._bundled import bundled


@pytest.mark.parametrize(
    ("name", "words"), [("uPlot.js", "uPlot"), ("uPlot.css", ".u-"), ("uPlot.LICENSE.txt", "MIT")]
)
def test_the_library_its_styles_and_its_licence_are_there(name, words):
    assert words in bundled(name)
