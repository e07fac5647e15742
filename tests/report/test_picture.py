# SPDX-License-Identifier: BSD-3-Clause
"""A picture of a page is one module and one template, in the folder of the page."""

import re
from importlib import resources

import pytest


@pytest.mark.parametrize("page", ["comparison", "diagnosis", "fleet"])
def test_every_picture_has_a_module_a_template_and_a_place(page):
    folders = [resources.files("skidyn.report").joinpath("_pages", f) for f in (page, "every")]
    files = {file.name: file for folder in folders for file in folder.iterdir()}
    sources = {n.removesuffix(".py"): f for n, f in files.items() if n.endswith(".py")}
    del sources["__init__"]
    templates = {n.removesuffix(".html.jinja") for n in files if n.endswith(".html.jinja")}
    assert templates == set(sources)
    places = [
        re.findall(r"^    place(?:, title)? = (\d+)", f.read_text(), re.M) for f in sources.values()
    ]
    assert all(len(found) == 1 for found in places)
    assert len({found[0] for found in places}) == len(places), "two pictures at one place"
