# SPDX-License-Identifier: BSD-3-Clause
"""The page of a comparison in a real browser."""

import pytest

from skidyn.report import summarize_comparison, write_html


@pytest.fixture
def compared(open_file, fakes, tmp_path):
    """Page and numbers of two recordings of different length, with names that hold markup."""
    pair = fakes.make_diagnosis(), fakes.make_diagnosis("unknown", n_samples=1500)
    summary = summarize_comparison(*pair, names=(fakes.HOSTILE, "worn"))
    return open_file(write_html(tmp_path / "wear.html", summary)), summary["report"], summary


def test_numbers_are_those_of_the_file(compared):
    page, report, _ = compared
    for side, name in enumerate(("first", "second")):
        cells = page.locator(f"#where [data-{name}]").all()
        shown = [float(cell.get_attribute(f"data-{name}")) for cell in cells]
        assert shown == report["sides"][side]["rmse_before"]
    rows = page.locator("table.findings tbody tr").all()
    assert len(rows) == len(report["findings"]) > 0
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")


def test_both_logs_are_read_under_one_cursor(compared):
    page, _, summary = compared
    over = page.locator("#panels .u-over").first
    over.scroll_into_view_if_needed()
    box = over.bounding_box()
    page.mouse.move(box["x"] + 0.2 * box["width"], box["y"] + 40)
    page.wait_for_function(  # a function: the page forbids that a string is evaluated
        "() => document.querySelector('#panels .u-value').textContent.endsWith(' s')"
    )
    values = page.locator(".panel:first-child .u-value").all_inner_texts()
    assert all(text.endswith((" s", " N m", " N")) for text in values)
    time = float(values[0].split()[0])
    joint = int(page.locator(".panel h4").first.inner_text().rpartition("(")[2][:-1]) - 1
    for shown, table in zip(values[4:6], summary["time"]["joints"][joint], strict=True):
        k = min(range(len(table["time"])), key=lambda i: abs(table["time"][i] - time))
        measured = table["columns"]["measured"][k]
        assert float(shown.split()[0].replace("−", "-")) == pytest.approx(measured, rel=0.02)


def test_all_is_drawn_and_printed(compared):
    page, *_ = compared
    blank = page.evaluate(
        "() => [...document.querySelectorAll('canvas')].filter((c) =>"
        " !c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((v) => v > 0)).length"
    )
    assert blank == 0
    assert len(page.pdf()) > 20_000
