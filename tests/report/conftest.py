# SPDX-License-Identifier: BSD-3-Clause
"""Made-up diagnoses for the tests of the report."""

import importlib.util
import shutil
from pathlib import Path

import pytest

pytest.importorskip("jinja2", reason="needs skidyn[report]")


@pytest.fixture(scope="session")
def fakes():
    """The module fakes.py beside this file (import-mode importlib puts no folder on the path)."""
    path = Path(__file__).with_name("fakes.py")
    specification = importlib.util.spec_from_file_location("skidyn_report_fakes", path)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


CHROMIUM = shutil.which("chromium")
ARGUMENTS = (
    "--no-sandbox", "--disable-gpu", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
)  # fmt: skip


@pytest.fixture(scope="module")
def browser():
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(ARGUMENTS))
        yield browser
        browser.close()


@pytest.fixture
def open_file(browser):
    """Open a page; whatever the console says and every request beside the file fails the test."""
    opened = []

    def open_it(path, **options):
        page = browser.new_page(viewport={"width": 1200, "height": 900}, **options)
        page.set_default_timeout(60_000)
        page.complaints = []
        page.on("console", lambda message: page.complaints.append(message.text))
        page.on("pageerror", lambda error: page.complaints.append(str(error)))
        page.on("dialog", lambda dialog: page.complaints.append(dialog.message))
        page.on(
            "request",
            lambda r: (
                None if r.url.startswith(("file:", "data:")) else page.complaints.append(r.url)
            ),
        )
        page.goto(path.as_uri())
        page.wait_for_selector("#plots[data-view]")
        page.wait_for_selector("html[data-drawn]")
        opened.append(page)
        return page

    yield open_it
    for page in opened:
        assert page.complaints == []
        page.close()
