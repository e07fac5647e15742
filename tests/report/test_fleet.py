# SPDX-License-Identifier: BSD-3-Clause
import json

import numpy as np

from skidyn.fleet import DriftReport, FleetComparison
from skidyn.report import render_fleet, summarize_fleet, write_fleet

COLUMNS = ("viscous.Fv[1]", "coulomb.Fc[2]")


def compared(hostile="robot 8"):
    """Twenty robots, one of which deviates."""
    names = tuple(f"robot {k}" if k != 8 else hostile for k in range(1, 21))
    score = np.tile(np.linspace(-1.5, 1.5, 20)[:, None], (1, 2))
    score[7, 0] = 12.0
    q = np.where(score > 10, 1e-9, 0.9)
    common = {"viscous.Fv[1]": 1.0, "coulomb.Fc[2]": 2.0}
    return FleetComparison(names, COLUMNS, common, 0.1 * score, score, q)


def watched():
    """A robot whose friction leaves its band."""
    value = np.array([[5.0], [5.1], [9.0]])
    low, high = np.array([[-np.inf], [4.0], [4.0]]), np.array([[np.inf], [6.0], [6.0]])
    return DriftReport(("coulomb.Fc[2]",), ("2 May", "3 May", "4 May"), value, low, high)


def test_headline_names_who_deviates_and_who_has_changed():
    summary = summarize_fleet(compared(), drift={"robot 3": watched()})
    assert summary["headline"] == (
        "1 of 20 robots deviates: robot 8; robot 3 has changed over time"
    )
    page = render_fleet(summary)
    assert "Fv of viscous friction on joint 1" in page
    assert "left its band on 4 May: 9.0, expected 4.0 to 6.0" in page


def test_a_fleet_without_deviation_says_so():
    fleet = compared()
    fleet.q_value[:] = 1.0
    summary = summarize_fleet(fleet)
    assert summary["headline"] == "None of the 20 robots deviates from the others"
    assert "Since when" not in render_fleet(summary)


def test_summary_is_pure_json_and_names_are_escaped(fakes, tmp_path):
    summary = summarize_fleet(compared(fakes.HOSTILE), drift={fakes.HOSTILE: watched()})
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary
    page = write_fleet(tmp_path / "fleet.html", summary).read_text()
    assert "<img" not in page


def test_page_of_a_fleet_draws(browser, tmp_path):
    path = write_fleet(
        tmp_path / "fleet.html", summarize_fleet(compared(), drift={"robot 3": watched()})
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
