# SPDX-License-Identifier: BSD-3-Clause
import json
from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import Settings, diagnose
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor
from skidyn.report import render_comparison, summarize_comparison, write_comparison


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
    assert "Only in “usual”: Dahl friction on joints 1 and 2" in summary["headline"]


def test_two_logs_keep_their_own_times(fakes):
    summary = summarize_comparison(*two_logs(fakes), names=("new", "worn"))
    assert not summary["report"]["same_log"]
    assert [len(tables) for tables in summary["time"]["joints"]] == [2, 2, 2]
    assert summary["time"]["starts"] == []  # the borders of one are not those of the other
    found = {(tuple(f["kinds"]), f["joint"]): f["in"] for f in summary["report"]["findings"]}
    assert found == {
        (("spring",), 3): ["new"], (("dahl",), 1): ["new", "worn"], (("dahl",), 2): ["new", "worn"],
    }  # fmt: skip


def test_rivals_are_one_finding(fakes):
    first, second = two_logs(fakes)
    second.findings = [replace(second.findings[0], kind="lugre", title="LuGre friction")]
    report = summarize_comparison(first, second)["report"]
    dahl = next(f for f in report["findings"] if f["joint"] == 1)
    assert dahl["kinds"] == ["dahl", "lugre"] and dahl["in"] == ["first", "second"]
    assert dahl["titles"] == ["Dahl friction", "LuGre friction"]


def test_curves_are_those_of_the_residual(fakes):
    summary = summarize_comparison(*two_logs(fakes))
    curve = next(o for o in summary["residuals"] if o["variable"] == "dq1")
    median = np.array(curve["sides"][0]["median"], dtype=float)
    x = np.array(curve["x"])
    known = np.isfinite(median) & (np.abs(x) > 0.1)
    assert median[known] == pytest.approx(3 * np.sign(x[known]), abs=0.3)


def test_names_and_joints_must_fit(fakes):
    first, second = two_models(fakes)
    with pytest.raises(SkidynError, match="two different names"):
        summarize_comparison(first, second, names=("a", "a"))
    other = fakes.make_diagnosis(joint_names=("a", "b", "c"))
    with pytest.raises(SkidynError, match="same joints"):
        summarize_comparison(first, other)


def test_markup_in_names_is_escaped(fakes):
    first, second = two_logs(fakes)
    page = render_comparison(summarize_comparison(first, second, names=(fakes.HOSTILE, "b")))
    assert "<img" not in page and page.count("</script>") == 3


def test_numbers_lie_beside_the_page(fakes, tmp_path):
    summary = summarize_comparison(*two_logs(fakes))
    page, numbers = write_comparison(tmp_path / "wear.html", summary)
    assert json.loads(numbers.read_text()) == summary["report"]
    with pytest.raises(SkidynError, match="another ending"):
        write_comparison(tmp_path / "wear.json", summary)


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
