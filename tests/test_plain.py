# SPDX-License-Identifier: BSD-3-Clause
"""Values of any kind as JSON has them."""

import json
from pathlib import Path

import numpy as np

from skidyn.report import write_json


def written(tmp_path, content):
    return json.loads(write_json(tmp_path / "a.json", content).read_text("utf-8"))


def test_what_json_has_no_word_for_becomes_none_or_text(tmp_path):
    given = {1: np.float32(0.5), "b": np.array([[1, 2]]), "c": float("inf"), "d": Path("a/b")}
    expected = {"1": 0.5, "b": [[1, 2]], "c": None, "d": str(Path("a/b")), "e": [3]}
    assert written(tmp_path, {**given, "e": {3}}) == expected


def test_truth_stays_truth_and_other_objects_are_named(tmp_path):
    given = {"a": [np.bool_(True), None], "b": ValueError("x")}
    assert written(tmp_path, given) == {"a": [True, None], "b": "x"}
