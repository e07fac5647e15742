# SPDX-License-Identifier: BSD-3-Clause
"""The truth about a hidden effect, as answers are compared with it."""

import json

import pytest


@pytest.mark.slow
def test_joints_count_from_one_and_values_are_those_of_json(written):
    (effect,) = json.loads(written.truth.read_text())["effects"]
    assert set(effect["joints"]) <= {1, 2} and effect["joints"]
    assert set(effect["scored_parameters"]) <= set(effect["parameters"])
    assert effect["formula"] == "tau0" and "trajectories" not in effect


@pytest.mark.slow
def test_trajectories_are_those_of_the_log(once):
    (effect,) = once.truth["effects"]
    assert set(effect["joints"]) <= {1, 2} and effect["variables"] == []
    assert set(effect["trajectories"]) <= set(once.frame["trajectory"])
    assert effect == json.loads(json.dumps(effect))
