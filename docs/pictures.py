# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of the pages that skidyn makes, for this documentation.

    python docs/pictures.py [--chromium /usr/bin/chromium]

Simulates what is shown (two minutes), opens it in Chromium and writes ``docs/_static/pictures``.
Look at them before they are committed.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import shutil
import subprocess
import sys
import tempfile
from importlib.resources import files
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

from skidyn.datasets import load_demo_log, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import Diagnosis, diagnose
from skidyn.identification import RBDRegressor
from skidyn.report import summarize, summarize_comparison, write_html

OUT = Path(__file__).parent / "_static" / "pictures"


def report(folder: Path) -> Path:
    """Page of the log of ``skidyn demo``."""
    log = load_demo_log()
    diagnosis = diagnose(RBDRegressor(log.robot), log.X, log.y)
    return write_html(folder / "report.html", summarize(diagnosis, title="Panda, simulated"))


def comparison(folder: Path) -> Path:
    """A UR5 whose third joint begins to rub more where it carries more."""

    def recorded(effect: str | None, seed: int) -> Diagnosis:
        log = make_hidden_effect_log(load_ur5(), effect, joints=[3], random_state=seed)
        return diagnose(RBDRegressor(log.robot), log.X, log.y)

    summary = summarize_comparison(
        recorded(None, 1), recorded("load_dependent_friction", 1), names=("new", "worn")
    )
    return write_html(folder / "wear.html", summary)


@contextlib.contextmanager
def explored(folder: Path):
    """Address of the explorer on the log of the demo."""
    load_demo_log().frame.to_csv(folder / "log.csv", index=False)
    urdf = files("skidyn.datasets").joinpath("robots", "panda.urdf")
    words = [str(folder / "log.csv"), "--urdf", str(urdf), "--no-browser", "--folder", str(folder)]
    with subprocess.Popen(
        [sys.executable, "-m", "skidyn", "explore", *words], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        try:
            yield next(line for line in process.stdout if line.startswith("open ")).split()[1]
        finally:
            process.kill()


def opened(browser: Browser, address: str, height: int, scheme: str = "light") -> Page:
    """A page at 1.5 times the usual resolution, drawn."""
    page = browser.new_page(
        viewport={"width": 1120, "height": height}, color_scheme=scheme, device_scale_factor=1.5
    )
    page.set_default_timeout(120_000)
    page.goto(address)
    return page


def save(page: Page, name: str, selector: str | None = None) -> None:
    """Write what is seen, or a part of it, as a PNG of 256 colours; the page is done with."""
    clip = None
    if selector:
        box = page.locator(selector).first.bounding_box()
        assert box is not None
        clip = {"x": box["x"] - 14, "y": box["y"] - 8, "width": box["width"] + 28,
                "height": box["height"] + 20}  # fmt: skip
    picture = Image.open(io.BytesIO(page.screenshot(clip=clip))).convert("RGB")
    picture.quantize(256, dither=Image.Dither.NONE).save(OUT / name, optimize=True)
    print(f"{name}: {(OUT / name).stat().st_size // 1024} kB")
    page.close()


def of_the_report(browser: Browser, path: Path) -> None:
    """Top; torque of two joints in both themes; a finding."""
    page = opened(browser, path.as_uri(), 800)
    page.wait_for_selector("#plots[data-view]")
    save(page, "report-top.png")
    for scheme in ("light", "dark"):
        page = opened(browser, path.as_uri(), 900, scheme)
        page.wait_for_selector("#plots[data-view]")
        page.locator("fieldset label", has_text="panda_joint2").locator("input").uncheck()
        bring(page, ".panel")
        box = page.locator("#panels .u-over").first.bounding_box()
        assert box is not None
        page.mouse.move(box["x"] + 0.26 * box["width"], box["y"] + 80)
        page.mouse.down()
        page.mouse.move(box["x"] + 0.42 * box["width"], box["y"] + 80)
        page.mouse.up()
        page.mouse.move(box["x"] + 0.62 * box["width"], box["y"] + 60)
        page.wait_for_timeout(300)
        save(page, f"report-{scheme}.png", ".panel")
    page = opened(browser, path.as_uri(), 900)
    bring(page, "article.finding")
    page.evaluate("scrollBy(0, -30)")
    save(page, "report-finding.png", "article.finding")


def bring(page: Page, selector: str) -> None:
    """Scroll something to the top, without the list of contents over it."""
    page.evaluate("document.querySelector('nav').remove()")
    page.evaluate("s => document.querySelector(s).scrollIntoView({behavior: 'instant'})", selector)
    page.evaluate("scrollBy(0, 20)")
    page.wait_for_timeout(1500)  # plots are drawn when they are near


def of_the_comparison(browser: Browser, path: Path) -> None:
    """Verdict, and the residuals of both."""
    page = opened(browser, path.as_uri(), 740)
    page.wait_for_selector("#plots[data-view]")
    save(page, "comparison.png")
    page = opened(browser, path.as_uri(), 460)
    bring(page, "#residuals")
    save(page, "comparison-residuals.png")


def of_the_explorer(browser: Browser, address: str) -> None:
    """After a first effect has been added."""
    page = opened(browser, address, 840)
    page.wait_for_selector("body[data-ranked]")
    page.select_option("#joint", "4")
    page.wait_for_selector("body[data-ranked^='4 ']")
    page.locator("#effects button").first.click()
    page.wait_for_selector("body[data-ranked$=' 2']")
    page.wait_for_timeout(3000)  # shapes are refined after the first answer
    page.evaluate("document.querySelector('#status').textContent = ''")  # a time of this machine
    page.add_style_tag(content=".hint + .hint, #effects li:nth-child(n + 3) { display: none }")
    save(page, "explorer.png")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--chromium", default=shutil.which("chromium"), help="browser to use")
    options = parser.parse_args()
    OUT.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        folder = Path(name)
        browser = playwright.chromium.launch(
            executable_path=options.chromium, args=["--no-sandbox", "--disable-gpu"]
        )
        of_the_report(browser, report(folder))
        of_the_comparison(browser, comparison(folder))
        with explored(folder) as address:
            of_the_explorer(browser, address)
        browser.close()


if __name__ == "__main__":
    main()
