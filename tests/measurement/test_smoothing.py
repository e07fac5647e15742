# SPDX-License-Identifier: BSD-3-Clause
"""Torque that was smoothed before it was recorded."""

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.logs import check_log
from skidyn.measurement import names_in_doubt

ROBOT = load_ur5()
TORQUES = [f"tau{k + 1}" for k in range(6)]


def told_of(frame):
    return {s.check: s for s in check_log(frame, ROBOT).checks if s.certainty != "noted"}


def made(effect):
    return make_hidden_effect_log(
        ROBOT, effect, n_trajectories=5, duration=6.0, random_state=4
    ).frame


@pytest.mark.parametrize(
    "effect",
    [
        None,
        pytest.param("dahl", marks=pytest.mark.slow),
        pytest.param("lugre", marks=pytest.mark.slow),
    ],
)
def test_friction_that_turns_with_its_joint(effect):
    assert "smoothed_torque" not in told_of(made(effect))


@pytest.mark.parametrize("samples", [21, 31])
def test_friction_that_turns_before_its_joint(samples):
    frame = made(None)
    for rows in frame.groupby("trajectory").groups.values():
        for name in TORQUES:
            values = uniform_filter1d(frame.loc[rows, name].to_numpy(), samples, mode="nearest")
            frame.loc[rows, name] = values
    told = told_of(frame)
    assert set(told) == {"smoothed_torque"} and told["smoothed_torque"].remedy is None
    assert len(told["smoothed_torque"].joints) >= 4
    assert names_in_doubt(list(told.values()))


def test_too_few_turns_to_tell():
    t = np.arange(0, 20, 0.01)
    frame = made(None).iloc[: len(t)]
    resting = frame.assign(**{f"dq{k + 1}": 0.0 for k in range(6)})
    assert "smoothed_torque" not in told_of(resting)


def test_a_torque_with_fast_noise_was_not_smoothed():
    frame = made(None)
    noise = np.random.default_rng(0).normal(size=(len(frame), 6))
    for rows in frame.groupby("trajectory").groups.values():
        for name in TORQUES:
            values = uniform_filter1d(frame.loc[rows, name].to_numpy(), 21, mode="nearest")
            frame.loc[rows, name] = values
    frame[TORQUES] += 0.02 * frame[TORQUES].std().to_numpy() * noise
    assert "smoothed_torque" not in told_of(frame)
