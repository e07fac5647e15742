# SPDX-License-Identifier: BSD-3-Clause
"""Made-up diagnoses for the tests of the report."""

import importlib.util
import re
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


def texts(page):
    """Words of every section of a page, by the section's name."""
    sections = re.findall(r'<section[^>]* id="([^"]+)".*?>(.*?)</section>', page, re.S)
    return {name: " ".join(re.sub(r"<[^>]+>", " ", part).split()) for name, part in sections}


@pytest.fixture(scope="session")
def diagnosis_page(fakes):
    """Words of the page of a diagnosis, by section."""
    from skidyn.report import render_html, summarize

    provenance = {"files": {"a.csv": "12"}}
    return texts(render_html(summarize(fakes.make_diagnosis(), provenance=provenance)))


@pytest.fixture(scope="session")
def comparison_page(fakes):
    """Words of the page of two logs, in the second of which the spring is gone."""
    from skidyn.report import render_html, summarize_comparison

    second = fakes.make_diagnosis(n_samples=1500)
    second.findings = second.findings[:1]
    both = fakes.make_diagnosis(), second
    return texts(render_html(summarize_comparison(*both, names=("new", "worn"))))


@pytest.fixture(scope="session")
def fleet_page(fakes):
    """Words of the page of a fleet, one robot of which deviates and one has changed."""
    from skidyn.report import render_html, summarize_fleet

    return texts(
        render_html(summarize_fleet(fakes.make_fleet(), drift={"robot 3": fakes.make_drift()}))
    )


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
