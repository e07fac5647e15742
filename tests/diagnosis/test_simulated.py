# SPDX-License-Identifier: BSD-3-Clause
"""What the simulated motion says stands in the report, in the story and in a notebook alike."""

import json

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.model_selection import held_out_folds
from skidyn.simulation import simulation_errors


@pytest.fixture(scope="module")
def diagnosis():
    log = make_hidden_effect_log(
        load_planar_arm(), "spring", joints=[1], n_trajectories=4, duration=4.0, random_state=0
    )
    model = RBDRegressor(log.robot, ("viscous", "coulomb"))
    found = diagnose(model, log.X, log.y, effects=("spring",), checks=())
    assert found.simulation is None and found.to_dict()["simulation"] is None
    assert found.story()["simulation"] is None and "simulation" not in found.to_dict()["effects"][0]
    found.judge_by_simulation(horizon=0.5)
    return found


@pytest.mark.slow
def test_errors_are_those_of_models_that_have_not_seen_the_motion(diagnosis):
    X, y = diagnosis.data
    pieces, squares = 0, np.zeros((2, 2))
    for train, test in held_out_folds(X["trajectory"].to_numpy(), 5):
        for k, effects in enumerate(([], diagnosis.findings[0].terms)):
            model = RBDRegressor(
                diagnosis.base_model.robot, ["viscous", "coulomb", *effects], consistent=True
            ).fit(X.iloc[train], y[train])
            errors = simulation_errors(model, X.iloc[test], y[test], horizon=0.5)
            squares[k] += len(errors.pieces) * errors.position**2
        pieces += len(errors.pieces)
    report = diagnosis.to_dict()["simulation"]
    assert report["units"] == ["rad", "rad"] and report["horizon"] == 0.5
    assert report["n_pieces"] == pieces
    for k, name in enumerate(("before", "after")):
        np.testing.assert_allclose(report[name]["position"], np.sqrt(squares[k] / pieces))
    assert report["says"] == "improves" and report["change"]["high"] < 0
    assert diagnosis.to_dict()["effects"][0]["simulation"]["says"] == "improves"
    json.dumps(report, allow_nan=False)


def test_the_story_tells_every_joint_in_its_units(diagnosis):
    report, motion = diagnosis.to_dict()["simulation"], diagnosis.story()["simulation"]
    assert motion["heading"].startswith("Simulated motion, 0.5 s at a time")
    assert motion["added"] and "falls" in motion["text"]
    for j, row in enumerate(motion["joints"]):
        assert (row["joint"], row["unit"], row["worse"]) == (j + 1, "rad", False)
        for model in ("before", "after"):
            for what in ("position", "velocity", "final"):
                assert row[model][what] == report[model][what][j]
        assert row["ratio"] == pytest.approx(row["after"]["position"] / row["before"]["position"])
    assert motion["heading"] in diagnosis._repr_html_()


def test_what_is_left_out_is_said_with_its_reason(diagnosis, monkeypatch):
    judged = diagnosis.in_turn
    before = judged.together.before
    none = type(judged.together)(before, before, 0.0, 0.0, 0.0, np.zeros(2))
    for verdict, why in ((judged.verdicts[0], "worsens the motion"), (None, "cannot be simulated")):
        left_out = type(judged)([verdict], [False], none)
        monkeypatch.setattr(diagnosis, "in_turn", left_out)
        motion = diagnosis.story()["simulation"]
        assert f"Left out because it {why}: spring on joint 1." in motion["text"]
        assert not motion["added"]
    assert diagnosis.to_dict()["effects"][0]["simulation"] == {
        "says": "nothing",
        "change": None,
        "added": False,
    }


def test_a_motion_that_is_lost_says_nothing(diagnosis, monkeypatch):
    judged = diagnosis.in_turn
    far = judged.together.before
    lost = type(far)(**{**vars(far), "pieces": np.full_like(far.pieces, np.inf)})
    lost = type(lost)(**{**vars(lost), "position": np.full(2, np.inf)})
    together = type(judged.together)(lost, lost, 0.0, 0.0, 0.0, np.zeros(2))
    monkeypatch.setattr(diagnosis, "in_turn", type(judged)([None], [True], together))
    motion, report = diagnosis.story()["simulation"], diagnosis.to_dict()["simulation"]
    assert "gives no evidence about the findings" in motion["text"]
    assert "grows without bound" in motion["text"] and motion["joints"][0]["ratio"] is None
    assert report["says"] == "nothing" and report["before"]["position"] == [None, None]
