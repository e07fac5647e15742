# SPDX-License-Identifier: BSD-3-Clause
"""Explanations in the order of what they do."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log


def test_the_first_of_a_ranking_was_added_and_rivals_score_less(missing):
    first = missing.result.findings[0]
    assert first.kind == "spring"
    assert all(other.kind != "spring" for other in first.others)
    rivals = [h.score for h in first.others if h.joints == first.joints]
    assert not rivals or max(rivals) < first.score


@pytest.mark.slow
def test_the_power_of_a_coupling_is_found(found_in):
    log = make_hidden_effect_log(load_planar_arm(), None, noise="low", random_state=3)
    speed = log.X["dq1"].to_numpy() + 0.8 * log.X["dq2"].to_numpy()
    drag = 0.4 * np.sign(speed) * np.abs(speed) ** 1.6
    torque = log.y + drag[:, None] * [1.0, 0.8]
    assert found_in(log.robot, log.X, torque) == {"coupled_friction": {1, 2}}
