# SPDX-License-Identifier: BSD-3-Clause
"""Something no name fits: its shape, and what the report holds of it."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np

from skidyn.diagnosis._unknown import describe_unknowns
from skidyn.effects import Term, get_effect


def test_the_shape_is_a_map_with_a_band_that_holds_the_truth(nameless):
    torque = nameless.diagnosis.unknowns[0]
    shape = torque.shape
    seen = np.isfinite(shape["value"])

    assert shape["value"].shape == (16, 16)
    assert seen.mean() > 0.3
    assert np.all(shape["low"][seen] <= shape["value"][seen])
    middle = [(e[1:] + e[:-1]) / 2 for e in shape["edges"]]
    grid = dict(zip(shape["variables"], np.meshgrid(*middle, indexing="ij"), strict=True))
    truth = eval(
        nameless.formula, {"sign": np.sign, "sin": np.sin, "cos": np.cos, "abs": abs}, grid
    )
    assert np.corrcoef(truth[seen], shape["value"][seen])[0, 1] > 0.9


def test_the_report_holds_tests_shape_and_formula(nameless):
    diagnosis = nameless.diagnosis

    text = json.dumps(diagnosis.to_dict(), allow_nan=False)

    (first, *_) = json.loads(text)["unexplained"]["torques"]
    assert first["formula"]["text"] == diagnosis.unknowns[0].proposal.text
    assert len(first["shape"]["value"]) == 16
    assert {t["variable"] for t in first["tests"] if t["needed"]} == set(first["variables"])


def test_a_joint_that_never_slides_has_no_shape_of_a_force_at_the_tool(missing):
    problem, noise = missing.problem, missing.result.fit.noise
    sliding = problem.rows.sliding.copy()
    sliding[:, 0] = False
    still = replace(problem, rows=replace(problem.rows, sliding=sliding))
    kind = "force_over_tool_position"
    term = Term(kind, (1, 2), get_effect(kind).grid(problem.signals, (0, 1))[0])
    found = describe_unknowns(still, [term], [term], noise)
    assert [torque.joint for torque in found] == [2]
