# SPDX-License-Identifier: BSD-3-Clause
from importlib import resources

import pytest

from skidyn.report._picture import Canvas, pictures


@pytest.mark.parametrize("page", ["comparison", "diagnosis", "fleet"])
def test_every_picture_is_a_module_and_a_template(page):
    folders = [resources.files("skidyn.report").joinpath("_pages", f) for f in (page, "every")]
    names = {entry.name for folder in folders for entry in folder.iterdir()}
    names -= {"__init__.py", "__pycache__"}
    found = pictures(page)
    assert names == {f"{name}.{end}" for name in found for end in ("py", "html.jinja")}
    places = [picture.place for picture in found.values()]
    assert places == sorted(set(places)), "two pictures at one place"


def test_a_figure_shown_twice_is_stored_once():
    canvas = Canvas()
    first = canvas.figure({"type": "bars", "values": [1.0]})
    assert canvas.figure({"type": "bars", "values": [2.0]}) != first
    assert canvas.figure({"type": "bars", "values": [1.0]}) == first
    assert len(canvas.numbers["figures"]) == 2
