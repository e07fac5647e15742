# SPDX-License-Identifier: BSD-3-Clause
"""Loading time of the report page of a long log in headless Chromium.

A Panda with a hidden hysteresis (300,000 rows of seven joints) is simulated and diagnosed, and its
page is opened from disk in a new tab each time. Printed are milliseconds from the start of the
navigation to the first paint, to the end of loading, and until every visible plot and every plot of
the page is drawn; and the processor time of the page's thread, in total and of scripts alone. All
are medians with minimum and maximum.

    python benchmarks/report/page_load.py [--rows 300000] [--loads 5]
"""

from __future__ import annotations

import argparse
import shutil
import statistics
import tempfile
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, sync_playwright

from skidyn.datasets import load_panda, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.report import summarize, write_html

TRAJECTORIES, RATE = 30, 100.0
#: The first frame after the end of loading contains the plots that are drawn while loading.
DRAWN = """() => new Promise((done) => {
  const painted = () => performance.getEntriesByName("first-contentful-paint").length;
  const ask = () => requestAnimationFrame(() => painted() ? done(performance.now()) : ask());
  const loaded = () => setTimeout(() => requestAnimationFrame(ask), 0);
  if (document.readyState === "complete") loaded(); else addEventListener("load", loaded);
})"""
TIMES = """() => {
  const [page] = performance.getEntriesByType("navigation");
  const [paint] = performance.getEntriesByName("first-contentful-paint");
  return { "first paint": paint.startTime, "load": page.loadEventEnd };
}"""
BLANK = """() => [...document.querySelectorAll("canvas")].filter((c) => {
  const box = c.getBoundingClientRect();
  return box.bottom > 0 && box.top < innerHeight
    && !c.getContext("2d").getImageData(0, 0, c.width, c.height).data.some((v) => v > 0);
}).length"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=300_000)
    parser.add_argument("--loads", type=int, default=5)
    parser.add_argument("--page", type=Path, help="measure this page instead")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        page = options.page or write_page(Path(folder, "report.html"), options.rows)
        print(f"page: {page.stat().st_size / 1e6:.2f} MB")
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
        )
        loaded(browser, page)  # the browser is warm from here on
        runs = [loaded(browser, page) for _ in range(options.loads)]
        for name in runs[0]:
            values = [run[name] for run in runs]
            print(
                f"{name:32s} {statistics.median(values):7.0f} ms"
                f"   ({min(values):.0f} to {max(values):.0f})"
            )


def write_page(path: Path, rows: int) -> Path:
    """Write the report of a simulated log."""
    log = make_hidden_effect_log(
        load_panda(), "dahl", n_trajectories=TRAJECTORIES, duration=rows / TRAJECTORIES / RATE
    )
    diagnosis = diagnose(RBDRegressor(log.robot), log.X, log.y, effects=["dahl", "stribeck"])
    print(f"{len(log.X)} rows, {log.robot.n_joints} joints, {len(diagnosis.findings)} finding(s)")
    write_html(path, summarize(diagnosis))
    return path


def loaded(browser: Browser, path: Path) -> dict[str, float]:
    """Times of one load in a new tab."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    page = context.new_page()
    inside = context.new_cdp_session(page)
    inside.send("Performance.enable", {"timeDomain": "threadTicks"})
    before = measured(inside)
    page.goto(path.resolve().as_uri(), wait_until="commit")
    drawn = page.evaluate(DRAWN)
    times = page.evaluate(TIMES)
    assert page.evaluate(BLANK) == 0, "a plot in the window is blank"
    page.wait_for_selector(
        "html[data-drawn]"
    )  # plots below the window, which are drawn while the page is idle
    rest = page.evaluate("performance.now()")
    after = measured(inside)
    context.close()
    return {
        **times,
        "visible plots drawn": drawn,
        "all plots drawn": rest,
        "processor time": 1e3 * (after["TaskDuration"] - before["TaskDuration"]),
        "of it scripts": 1e3 * (after["ScriptDuration"] - before["ScriptDuration"]),
        "of it layout and styles": 1e3
        * sum(after[name] - before[name] for name in ("LayoutDuration", "RecalcStyleDuration")),
    }


def measured(inside: Any) -> dict[str, float]:
    return {m["name"]: m["value"] for m in inside.send("Performance.getMetrics")["metrics"]}


if __name__ == "__main__":
    main()
