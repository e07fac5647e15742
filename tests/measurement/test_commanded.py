# SPDX-License-Identifier: BSD-3-Clause
"""Positions without noise."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.logs import check_log

ROBOT = load_planar_arm()
FRAME = make_hidden_effect_log(
    ROBOT, "stribeck", joints=[2], n_trajectories=4, duration=6.0, random_state=3
).frame


def told(frame):
    return {s.check: s for s in check_log(frame, ROBOT).checks}


def test_commands_ahead_of_the_motion():
    frame, lead = FRAME.copy(), 0.02
    for _, own in FRAME.groupby("trajectory"):
        t = own["time"].to_numpy()
        for k in (1, 2):
            path = CubicSpline(t, gaussian_filter1d(own[f"q{k}"].to_numpy(), 3))
            frame.loc[own.index, f"q{k}"] = path(t + lead)
            frame.loc[own.index, f"dq{k}"] = path(t + lead, 1)
    found = told(frame)
    one = found["commanded_motion"]
    assert one.certainty == "noted" and one.joints == (1, 2)
    assert "ahead of the torque by" in one.evidence
    assert found["torque_delay"].remedy.option.startswith("--late tau=0.0")


@pytest.mark.slow
def test_positions_of_uneven_samples_scatter_by_their_noise():
    """A smooth motion has next to none, whatever the steps of the clock."""
    rng = np.random.default_rng(0)
    frame, lead = FRAME.copy(), 0.02
    for _, own in FRAME.groupby("trajectory"):
        t = own["time"].to_numpy()
        at = t + rng.uniform(-0.25, 0.25, t.size) * np.median(np.diff(t))
        frame.loc[own.index, "time"] = at
        for k in (1, 2):
            path = CubicSpline(t, gaussian_filter1d(own[f"q{k}"].to_numpy(), 3))
            frame.loc[own.index, f"q{k}"] = path(at + lead)
            frame.loc[own.index, f"dq{k}"] = path(at + lead, 1)
            frame.loc[own.index, f"tau{k}"] = np.interp(at, t, own[f"tau{k}"])
    noise = rng.normal(size=len(frame))
    for size, scatter in ((0.0, "2e-09"), (6e-8, "6e-08")):
        one = told(frame.assign(q1=frame["q1"] + size * noise))["commanded_motion"]
        assert f"scatter by at most {scatter} rad" in one.evidence
    assert "commanded_motion" not in told(frame.assign(q1=frame["q1"] + 2e-7 * noise))


def test_measured_positions():
    noise = np.random.default_rng(0).normal(0, 1e-5, (len(FRAME), 2))
    assert "commanded_motion" not in told(FRAME.assign(q1=FRAME["q1"] + noise[:, 0]))
