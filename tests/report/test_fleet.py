# SPDX-License-Identifier: BSD-3-Clause
import json

from skidyn.report import render_html, summarize_fleet, write_html


def test_headline_names_who_deviates_and_who_has_changed(fakes):
    summary = summarize_fleet(fakes.make_fleet(), drift={"robot 3": fakes.make_drift()})
    assert summary["headline"] == (
        "1 of 20 robots deviates: robot 8; robot 3 has changed over time"
    )
    page = render_html(summary)
    assert "Fv of viscous friction on joint 1" in page
    assert "left its band on 4 May: 9.0, expected 4.0 to 6.0" in page


def test_a_fleet_without_deviation_says_so(fakes):
    fleet = fakes.make_fleet()
    fleet.q_value[:] = 1.0
    summary = summarize_fleet(fleet)
    assert summary["headline"] == "None of the 20 robots deviates from the others"
    assert "Start of the change" not in render_html(summary)


def test_summary_is_pure_json_and_names_are_escaped(fakes, tmp_path):
    summary = summarize_fleet(
        fakes.make_fleet(fakes.HOSTILE), drift={fakes.HOSTILE: fakes.make_drift()}
    )
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary
    page = write_html(tmp_path / "fleet.html", summary).read_text()
    assert "<img" not in page


def test_page_of_a_fleet_draws(browser, fakes, tmp_path):
    path = write_html(
        tmp_path / "fleet.html",
        summarize_fleet(fakes.make_fleet(), drift={"robot 3": fakes.make_drift()}),
    )
    page = browser.new_page(viewport={"width": 390, "height": 844})
    said = []
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto(path.as_uri())
    page.wait_for_selector("html[data-drawn]")
    assert page.locator("canvas").count() == 2
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    assert said == []
    page.close()
