# SPDX-License-Identifier: BSD-3-Clause
"""The page in a real browser: opens from disk without an error, zooms, shows values."""

import shutil

import pytest

from skidyn.report import summarize, write_html

CHROMIUM = shutil.which("chromium")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
ARGUMENTS = (
    "--no-sandbox", "--disable-gpu", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
)  # fmt: skip


@pytest.fixture(scope="module")
def browser():
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(ARGUMENTS))
        yield browser
        browser.close()


@pytest.fixture
def open_page(browser, tmp_path):
    """Open a diagnosis; whatever the console says and every request beside the file is recorded."""
    opened = []

    def open_it(diagnosis, **options):
        path = write_html(tmp_path / "report.html", summarize(diagnosis))
        page = browser.new_page(viewport={"width": 1200, "height": 900}, **options)
        page.set_default_timeout(10_000)
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
        opened.append(page)
        return page

    yield open_it
    for page in opened:
        assert page.complaints == []
        page.close()


def view(page):
    return [float(t) for t in page.get_attribute("#plots", "data-view").split()]


def wait_for_view(page, low, high):
    page.wait_for_function(
        "([a, b]) => {"
        " const v = document.getElementById('plots').dataset.view.split(' ').map(Number);"
        " return Math.abs(v[0] - a) < 0.2 && Math.abs(v[1] - b) < 0.2; }",
        arg=[low, high],
    )


@pytest.mark.parametrize("verdict", ["complete", "missing", "unknown"])
def test_opens_and_draws(open_page, fakes, verdict):
    names = (fakes.HOSTILE, "elbow", "slider")
    page = open_page(fakes.make_diagnosis(verdict, names))
    assert page.get_attribute("#verdict", "data-verdict") == verdict
    assert page.locator("canvas").count() >= 1
    drawn = page.evaluate(
        "() => { const c = document.querySelector('canvas');"
        " const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
        " return d.some((v) => v > 0); }"
    )
    assert drawn
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")


def test_dragging_zooms_all_joints_and_double_click_goes_back(open_page, fakes):
    page = open_page(fakes.make_diagnosis())
    for tick in page.locator("fieldset input").all():
        tick.check()
    assert page.locator("canvas").count() == 3
    whole = view(page)
    box = page.locator("canvas").first.bounding_box()
    left, wide = box["x"] + 58, box["width"] - 68
    page.mouse.move(left + 0.25 * wide, box["y"] + 50)
    page.mouse.down()
    page.mouse.move(left + 0.5 * wide, box["y"] + 50)
    page.mouse.up()
    wait_for_view(page, 0.25 * whole[1], 0.5 * whole[1])
    page.mouse.dblclick(left + 20, box["y"] + 50)
    wait_for_view(page, *whole)


def test_keyboard_zooms_and_moves(open_page, fakes):
    page = open_page(fakes.make_diagnosis())
    whole = view(page)
    page.locator("canvas").first.focus()
    page.keyboard.press("+")
    wait_for_view(page, whole[1] / 4, 3 * whole[1] / 4)
    page.keyboard.press("ArrowRight")
    wait_for_view(page, 0.35 * whole[1], 0.85 * whole[1])
    page.keyboard.press("0")
    wait_for_view(page, *whole)


def test_hover_tells_values(open_page, fakes):
    page = open_page(fakes.make_diagnosis())
    box = page.locator("canvas").first.bounding_box()
    page.mouse.move(box["x"] + 300, box["y"] + 60)
    text = page.locator(".tip").first.inner_text()
    assert "in trajectory 0" in text and "measured" in text and "residual" in text


def test_dark_and_light(open_page, fakes):
    page = open_page(fakes.make_diagnosis(), color_scheme="dark")
    background = "getComputedStyle(document.body).backgroundColor"
    dark = page.evaluate(background)
    page.click("#theme")
    assert page.evaluate(background) == "rgb(255, 255, 255)" != dark


def test_prints_in_full_on_white(open_page, fakes):
    page = open_page(fakes.make_diagnosis(), color_scheme="dark")
    assert len(page.pdf()) > 20_000
    page.emulate_media(media="print")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"


def test_a_long_log_opens(open_page, fakes):
    page = open_page(fakes.make_diagnosis(n_samples=300_000))
    assert view(page)[1] == pytest.approx(3000, rel=1e-3)
