# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn add``."""

import json

from skidyn import cli


def test_add_lowers_the_error_of_the_joint(diagnosed, run):
    out = diagnosed / "better.json"
    code, errors = run(
        "add", "--from", diagnosed / "report.json", "--effect", "stribeck", "--joints", "2",
        "--out", out,
    )  # fmt: skip
    assert code == cli.DONE
    assert errors["after"][1] < 0.5 * errors["before"][1]
    effects = json.loads(out.read_text("utf-8"))["effects"]
    assert ("stribeck", [2]) in [(e["kind"], e["joints"]) for e in effects]
