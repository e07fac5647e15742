# SPDX-License-Identifier: BSD-3-Clause
"""A page loads nothing, its text is escaped, and it works in a real browser."""

import json
import re
from pathlib import Path

import pytest

from skidyn.report import render_html, summarize, write_html, write_json


def test_markup_in_names_is_escaped(fakes):
    names = (fakes.HOSTILE, "</script><script>alert(2)</script>", 'it\'s "quoted"')
    diagnosis = fakes.make_diagnosis("unknown", names)
    diagnosis.warnings = [fakes.HOSTILE]
    page = render_html(summarize(diagnosis, title=fakes.HOSTILE, provenance={"x": fakes.HOSTILE}))
    assert "<img" not in page
    assert "<script>alert" not in page
    assert page.count("</script>") == 3


def test_page_loads_nothing(fakes):
    page = render_html(summarize(fakes.make_diagnosis()))
    assert not re.search(r"""(?:src|href)=["']?(?:https?:)?//""", page)
    assert "url(" not in page and "@import" not in page
    assert "default-src 'none'" in page
    for bundled in ("uPlot", ".u-wrap", "Permission is hereby granted"):  # with its licence
        assert bundled in page


def test_non_finite_numbers_do_not_break_the_page(fakes):
    diagnosis = fakes.make_diagnosis()
    diagnosis.noise[0] = float("nan")
    diagnosis.findings[0].curves[0]["measured"][:3] = float("nan")
    page = render_html(summarize(diagnosis))
    assert "nan" not in page.partition("<script")[0].lower().replace("provenance", "")


@pytest.fixture
def open_page(open_file, tmp_path):
    """Open the report of a diagnosis."""

    def open_it(diagnosis, **options):
        return open_file(write_html(tmp_path / "report.html", summarize(diagnosis)), **options)

    return open_it


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
    blank = page.evaluate(
        "() => [...document.querySelectorAll('canvas')].filter((c) =>"
        " !c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((v) => v > 0)).length"
    )
    assert blank == 0
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")


def test_names_of_joints_break_between_their_words(open_page, fakes):
    names = ("shoulder_lift_joint", "panda_joint4", "lwr_6_joint")
    page = open_page(fakes.make_diagnosis("missing", names))
    cells = page.locator("#errors th[scope=row]").all()
    assert {cell.inner_text().split(" (")[0].replace("\n", "") for cell in cells} == set(names)
    for cell in cells:  # at most two lines for the name and one for the number
        assert cell.bounding_box()["height"] < 80


def over(page, number=0):
    """Place of the curves of a plot: x, y, width, height."""
    place = page.locator("#panels .u-over").nth(number)
    place.scroll_into_view_if_needed()
    box = place.bounding_box()
    return box["x"], box["y"], box["width"], box["height"]


def legend(page, place="#panels"):
    """What the legends say: name to value."""
    rows = page.locator(f"{place} .u-series").all()
    return [(r.locator(".u-label").inner_text(), r.locator(".u-value").inner_text()) for r in rows]


def value(text):
    return float(text.split()[0].replace("−", "-"))


def test_dragging_zooms_all_joints_and_double_click_goes_back(open_page, fakes):
    page = open_page(fakes.make_diagnosis())
    for tick in page.locator("fieldset input").all():
        tick.check()
    assert page.locator("#panels canvas").count() == 6
    whole = view(page)
    x, y, width, _ = over(page)
    page.mouse.move(x + 0.25 * width, y + 50)
    page.mouse.down()
    page.mouse.move(x + 0.5 * width, y + 50)
    page.mouse.up()
    wait_for_view(page, 0.25 * whole[1], 0.5 * whole[1])
    x, y, *_ = over(page, 3)
    page.mouse.dblclick(x + 20, y + 50)
    wait_for_view(page, *whole)


def test_keyboard_zooms_moves_and_reads(open_page, fakes):
    page = open_page(fakes.make_diagnosis())
    whole = view(page)
    page.locator(".panel").first.focus()
    page.keyboard.press("+")
    wait_for_view(page, whole[1] / 4, 3 * whole[1] / 4)
    page.keyboard.press("ArrowRight")
    wait_for_view(page, 0.35 * whole[1], 0.85 * whole[1])
    page.keyboard.press("0")
    wait_for_view(page, *whole)
    page.keyboard.press("Shift+ArrowRight")
    said = page.locator("#plots [role=status]").inner_text()
    assert "in trajectory 1" in said and "with the findings" in said


def test_a_name_in_the_legend_hides_its_curve(open_page, fakes):
    page = open_page(fakes.make_diagnosis())
    row = page.locator("#panels .u-series").nth(1)
    row.locator("th").focus()
    page.keyboard.press("Enter")
    assert "u-off" in row.get_attribute("class")


def test_hover_shows_the_numbers_of_the_summary(open_page, fakes):
    diagnosis = fakes.make_diagnosis()
    trace = summarize(diagnosis)["time"]["traces"][0]
    torque = trace["columns"]
    page = open_page(diagnosis)
    x, y, width, _ = over(page)
    page.mouse.move(x + 0.4 * width, y + 60)
    page.wait_for_function(
        "document.querySelector('#panels .u-value').textContent.includes('s in')"
    )
    said = legend(page, ".panel:first-child")
    time, trajectory = said[0][1].split(" s in trajectory ")
    start = next(s["time"] for s in trace["starts"] if s["trajectory"] == int(trajectory))
    k = min(range(len(trace["time"])), key=lambda i: abs(trace["time"][i] - start - float(time)))
    shown = [value(text) for _, text in said[4:7]]
    assert shown == pytest.approx([torque[key][k] for key in ("measured", "before", "after")], 1e-3)
    residuals = [torque["measured"][k] - torque[key][k] for key in ("before", "after")]
    assert [value(text) for _, text in said[1:3]] == pytest.approx(residuals, rel=1e-3, abs=1e-6)


def test_the_cursor_of_one_joint_reads_all(open_page, fakes):
    page = open_page(fakes.make_diagnosis())
    x, y, width, _ = over(page)
    page.mouse.move(x + 0.4 * width, y + 60)
    page.wait_for_function(
        "[...document.querySelectorAll('#panels .u-value')].every((v) => v.textContent !== '–')"
    )


def test_pictures_of_findings_show_values(open_page, fakes):
    diagnosis = fakes.make_diagnosis()
    curve = summarize(diagnosis)["what"][0]["curves"][0]
    page = open_page(diagnosis)
    picture = page.locator(".finding [data-figure='0'] .u-over")
    picture.scroll_into_view_if_needed()
    box = picture.bounding_box()
    page.mouse.move(box["x"] + 0.7 * box["width"], box["y"] + 40)
    said = legend(page, ".finding [data-figure='0']")
    x, residual, effect = (value(text) for _, text in (said[0], said[3], said[4]))
    k = min(range(len(curve["x"])), key=lambda i: abs(curve["x"][i] - x))
    shown = [residual, effect]
    assert shown == pytest.approx([curve[n][k] for n in ("measured", "effect")], rel=1e-3)


def test_numbers_of_the_page_are_those_of_the_file(open_page, fakes, tmp_path):
    diagnosis = fakes.make_diagnosis()
    file = write_json(tmp_path / "report.json", diagnosis.to_dict())
    written = json.loads(file.read_text())
    page = open_page(diagnosis)
    for key in ("before", "after"):
        cells = page.locator(f"#errors [data-{key}]").all()
        shown = [float(c.get_attribute(f"data-{key}")) for c in cells]
        assert sorted(shown) == sorted(written[f"rmse_{key}"])


def test_dark_and_light(open_page, fakes):
    page = open_page(fakes.make_diagnosis(), color_scheme="dark")
    background = "getComputedStyle(document.body).backgroundColor"
    dark = page.evaluate(background)
    page.click("#theme")
    assert page.evaluate(background) == "rgb(255, 255, 255)" != dark


@pytest.mark.parametrize("scheme", [pytest.param("light", marks=pytest.mark.slow), "dark"])
def test_text_has_the_contrast_of_aa(open_page, fakes, scheme):
    page = open_page(fakes.make_diagnosis("unknown"), color_scheme=scheme)
    found = page.evaluate(Path(__file__).with_name("contrast.js").read_text("utf-8"))
    assert found["seen"] > 100 and found["poor"] == {}


def test_prints_in_full_on_white(open_page, fakes):
    page = open_page(fakes.make_diagnosis(), color_scheme="dark")
    assert len(page.pdf()) > 20_000
    page.emulate_media(media="print")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"


def test_a_long_log_opens(open_page, fakes, tmp_path):
    names = [f"joint{j}" for j in range(1, 8)]
    page = open_page(fakes.make_diagnosis(joint_names=names, n_samples=100_000))
    assert view(page)[1] == pytest.approx(1000, rel=0.02)
    assert (tmp_path / "report.html").stat().st_size < 3e6
