# SPDX-License-Identifier: BSD-3-Clause
"""Values of any kind as JSON has them."""

import json
from pathlib import Path

import numpy as np

from skidyn._plain import plain


def test_what_json_has_no_word_for_becomes_none_or_text():
    made = plain(
        {1: np.float32(0.5), "b": np.array([[1, 2]]), "c": float("inf"), "d": Path("a/b"), "e": {3}}
    )
    assert made == {"1": 0.5, "b": [[1, 2]], "c": None, "d": str(Path("a/b")), "e": [3]}
    assert json.loads(json.dumps(made, allow_nan=False)) == made


def test_truth_stays_truth_and_other_objects_are_named():
    assert plain([np.bool_(True), None]) == [True, None]
    assert plain(ValueError("x")) == "x"
