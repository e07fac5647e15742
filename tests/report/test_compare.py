# SPDX-License-Identifier: BSD-3-Clause
from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import Settings, diagnose
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor
from skidyn.report import summarize_comparison, write_html


def two_models(fakes):
    return fakes.make_diagnosis(), fakes.make_diagnosis("complete")


def two_logs(fakes):
    second = fakes.make_diagnosis(n_samples=1500)
    second.findings = second.findings[:1]
    return fakes.make_diagnosis(), second


def test_two_models_of_one_log_share_their_rows(fakes):
    first, second = two_models(fakes)
    second.comparison.measured[:] = first.comparison.measured
    summary = summarize_comparison(first, second, names=("usual", "whole"))
    assert summary["report"]["same_log"]
    (table,) = summary["time"]["joints"][0]
    assert set(table["columns"]) == {"measured", "first", "second"}
    ratio = summary["report"]["ratios"][0]
    assert ratio["low"] < ratio["ratio"] < ratio["high"]
    assert "Missing only in “usual”: Dahl friction on joints 1 and 2" in summary["headline"]
    assert summary["sentence"] == summary["sentence"].strip()


def test_rivals_are_one_finding(fakes):
    first, second = two_logs(fakes)
    second.findings = [replace(second.findings[0], kind="lugre", title="LuGre friction")]
    report = summarize_comparison(first, second)["report"]
    dahl = next(f for f in report["findings"] if f["joint"] == 1)
    assert dahl["kinds"] == ["dahl", "lugre"] and dahl["in"] == ["first", "second"]
    assert dahl["titles"] == ["Dahl friction", "LuGre friction"]


def test_what_is_uncertain_in_both_is_only_possible(fakes):
    first, second = two_logs(fakes)
    first.findings = [replace(f, confidence=0.3) for f in first.findings]
    second.findings = []
    summary = summarize_comparison(first, second, names=("usual", "whole"))
    assert "Missing only in “usual”: possibly Dahl friction" in summary["headline"]
    second.findings = first.findings
    summary = summarize_comparison(first, second)
    assert "The same effects may be missing in both" in summary["headline"]
    assert "Missing in both: possibly Dahl friction" in summary["sentence"]


def test_names_and_joints_must_fit(fakes):
    first, second = two_models(fakes)
    with pytest.raises(SkidynError, match="two different names"):
        summarize_comparison(first, second, names=("a", "a"))
    other = fakes.make_diagnosis(joint_names=("a", "b", "c"))
    with pytest.raises(SkidynError, match="same joints"):
        summarize_comparison(first, other)


@pytest.fixture(scope="module")
def worn():
    """A simulated arm before and after its second joint has begun to rub more."""
    log = make_hidden_effect_log(load_planar_arm(), None)
    model = RBDRegressor(log.robot, ("viscous", "coulomb"))
    trajectory = log.X["trajectory"].to_numpy()
    more = np.outer(np.sign(log.X["dq2"]), [0.0, 0.5])
    return [
        diagnose(
            model, log.X[rows], (log.y + wear * more)[rows], effects=("offset",),
            settings=Settings(max_findings=0),
        )
        for wear, rows in ((0, trajectory < 3), (1, trajectory >= 3))
    ]  # fmt: skip


def test_coefficients_tell_what_has_changed(worn):
    rows = {c["name"]: c for c in summarize_comparison(*worn)["report"]["coefficients"]}
    changed = rows["coulomb.Fc[2]"]
    assert changed["differs"]
    old, new = changed["sides"]
    assert old["low"] < old["value"] < old["high"] < new["low"]
    assert not rows["coulomb.Fc[1]"]["differs"]


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
