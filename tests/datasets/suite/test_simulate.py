# SPDX-License-Identifier: BSD-3-Clause
"""A controller tracks the same motion with and without a hidden effect."""

import json

import numpy as np
import pytest


@pytest.mark.slow
def test_the_torque_of_a_hidden_effect_is_what_its_truth_says(empty, written):
    (effect,) = json.loads(written.truth.read_text())["effects"]
    (joint,), (size,) = effect["joints"], effect["parameters"]["tau0"]
    other = 3 - joint
    torque, positions = (
        written.frame[[f"{name}{j}" for j in (joint, other)]].to_numpy()
        - empty.frame[[f"{name}{j}" for j in (joint, other)]].to_numpy()
        for name in ("tau", "q")
    )
    assert np.abs(positions).max() < 1e-2
    moves = (np.abs(empty.frame[["dq1", "dq2"]]) > 0.1).all(axis=1).to_numpy()
    assert abs(torque[moves, 0].mean() - size) < 0.1 * abs(size)
    assert abs(torque[moves, 1].mean()) < 0.1 * empty.truth["noise_std"][other - 1]
