# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn identify``."""

import json

import numpy as np
import pytest

from skidyn import cli


def test_identify_writes_parameters(diagnosed, run, arguments):
    out = diagnosed / "parameters.json"
    code, content = run("identify", *arguments, "--out", out)
    assert code == cli.DONE
    assert content == json.loads(out.read_text("utf-8"))
    assert np.shape(content["inertial_parameters"]) == (2, 10)
    assert {e["kind"] for e in content["effects"]} == {"viscous", "coulomb"}
    assert content["condition_number"] > 1 and content["open_combinations"] == []


@pytest.mark.parametrize("estimator", ["weighted", "ordinary", "robust", "ridge", "entropic"])
def test_identify_by_any_estimator_and_only_what_is_essential(capsys, estimator, arguments):
    words = ["identify", *arguments, "--estimator", estimator, "--consistent"]
    assert cli.main([*words, "--essential"]) == cli.DONE
    out = capsys.readouterr().out
    assert "condition number of the excitation" in out and "other parameters are left out" in out


@pytest.mark.slow
def test_servos_are_identified_without_torque(servo_diagnosed, run):
    words = ["identify", *servo_diagnosed[1:6], "--nominal"]
    code, found = run(*words)
    sizes = {(e["kind"], tuple(e["joints"])): e["coefficients"][0] for e in found["effects"]}
    assert code == cli.DONE
    assert sizes["coulomb", (1,)] == pytest.approx(0.8, rel=0.1)
    code, refined = run(*words, "--estimator", "output_error")
    (one,) = [e for e in refined["effects"] if e["kind"] == "coulomb" and e["joints"] == [1]]
    assert code == cli.DONE and one["coefficients"][0] == pytest.approx(0.8, rel=0.05)


def test_without_torque_and_controller_the_log_is_refused(servo_diagnosed, run):
    assert cli.main(["identify", *servo_diagnosed[1:4]]) == 2


def test_suspicions_about_the_log_head_the_result(flipped_log, capsys, run):
    words = ["identify", *flipped_log]
    assert cli.main(words) == cli.DONE
    out = capsys.readouterr().out
    assert out.startswith("Check the log first:")
    assert out.index("fix it with: --flip tau2") < out.index("condition number")
    code, content = run(*words)
    assert code == cli.DONE and content["checks"][0]["remedy"]["option"] == "--flip tau2"
