# SPDX-License-Identifier: BSD-3-Clause
from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import Settings, diagnose
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor
from skidyn.report import summarize_comparison


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


def test_rivals_are_one_finding(fakes):
    first, second = two_logs(fakes)
    second.findings = [replace(second.findings[0], kind="lugre", title="LuGre friction")]
    report = summarize_comparison(first, second)["report"]
    dahl = next(f for f in report["findings"] if f["joint"] == 1)
    assert dahl["kinds"] == ["dahl", "lugre"] and dahl["in"] == ["first", "second"]
    assert dahl["titles"] == ["Dahl friction", "LuGre friction"]


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
