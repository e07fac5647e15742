# SPDX-License-Identifier: BSD-3-Clause
"""The first screen of a comparison."""

from skidyn.report import summarize_comparison, write_html


def test_both_are_named(comparison_page):
    assert "new" in comparison_page["verdict"] and "worn" in comparison_page["verdict"]


def test_long_names_of_models_fit_into_their_columns(fakes, open_file, tmp_path):
    names = ("rigid_body,viscous,coulomb", "rigid_body,viscous,coulomb,offset,rotor_inertia")
    first, second = fakes.make_diagnosis(), fakes.make_diagnosis(n_samples=1500)
    summary = summarize_comparison(first, second, names=names)
    page = open_file(write_html(tmp_path / "both.html", summary))
    wider = "all => all.filter(one => one.scrollWidth > one.clientWidth + 1).length"
    for places in (".both dt", ".scroll[aria-label='Errors of both']"):
        assert page.locator(places).count() > 0
        assert page.locator(places).evaluate_all(wider) == 0
