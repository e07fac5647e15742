# SPDX-License-Identifier: BSD-3-Clause
"""The recipes for contributors work as they stand."""

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest
from sklearn.utils.estimator_checks import parametrize_with_checks

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import unregister_effect
from skidyn.identification import ESTIMATORS, RBDRegressor
from skidyn.logs import read_log, register_reader

RECIPES = Path(__file__).parents[2] / "docs" / "contributing"


def smallest_estimator():
    path = RECIPES / "smallest_estimator.py"
    specification = importlib.util.spec_from_file_location("skidyn_smallest_estimator", path)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


class AnyColumns(smallest_estimator().DragRegressor):
    """Takes whatever columns scikit-learn's checks bring."""

    def _resolve(self, n_features):
        return smallest_estimator().Columns((0,), (1 % n_features,), (2 % n_features,))

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.regressor_tags.poor_score = True  # on columns that mean nothing
        return tags


@parametrize_with_checks([AnyColumns(robot=None)])
def test_scikit_learn_contract(estimator, check):
    check(estimator)


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(load_planar_arm(), None)


def test_smallest_estimator_reads_a_log(log):
    drag = smallest_estimator().DragRegressor(log.robot).fit(log.X, 2.0 * log.X[["dq1", "dq2"]])
    assert drag.Fv_ == pytest.approx([2.0, 2.0])


def test_an_effect_as_the_recipe_writes_it(log):
    text = (RECIPES / "effect.rst").read_text("utf-8")
    block = re.search(r"code-block:: python\n\n((?:   .*\n|\n)+)", text)[1]
    exec(re.sub(r"^   ", "", block, flags=re.MULTILINE), {"__name__": "recipe"})
    try:
        q, dq = (log.X[[f"{name}1", f"{name}2"]].to_numpy() for name in ("q", "dq"))
        drag = 1.5 * np.maximum(0.0, q[:, 1] - 0.3) * dq[:, 1] * np.abs(dq[:, 1])
        model = RBDRegressor(log.robot, ("viscous", "coulomb", ("liquid_drag", [2])))
        fitted = model.fit(log.X, log.y + np.outer(drag, [0.0, 1.0]))
        assert fitted.parameter_table()[-1]["value"] == pytest.approx(1.5, rel=0.05)
    finally:
        unregister_effect("liquid_drag")


def test_six_recipes_run_as_they_stand(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (RECIPES / "recipes.rst").read_text("utf-8")
    blocks = re.findall(r"code-block:: python\n\n((?:   .*\n|\n)+)", text)
    assert len(blocks) == 6
    names = {"__name__": "recipes"}
    monkeypatch.setitem(ESTIMATORS, "median", None)
    try:
        for block in blocks:
            exec(re.sub(r"^   ", "", block, flags=re.MULTILINE), names)
        log, frame = names["log"], names["frame"]
        assert len(frame) == len(log.y) and names["robot"].joint_names == log.robot.joint_names
        assert names["picture"] == {"number": 0}
        assert len(names["diagnosis"].findings) == 1
        (tmp_path / "log.stars").write_text("time*q1*dq1*tau1\n0.0*1.0*0.1*2.0\n0.1*1.1*0.1*2.0\n")
        assert len(read_log("log.stars", check=False)) == 2
        air = RBDRegressor(log.robot, ("viscous", "coulomb", "air_drag"), estimator="median")
        air.fit(log.X, log.y + 4.0 * log.X[["dq1", "dq2"]] * log.X[["dq1", "dq2"]].abs())
        drag = [row["value"] for row in air.parameter_table()[-2:]]
        assert drag == pytest.approx([4.0, 4.0], rel=0.2) and np.all(air.coef_std_ > 0)
    finally:
        unregister_effect("air_drag")
        register_reader(".stars", None)
