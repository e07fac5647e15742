# SPDX-License-Identifier: BSD-3-Clause
"""What recordings tell, and how it adds up."""

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.effects import Term
from skidyn.exceptions import SkidynError
from skidyn.excitation import design_excitation
from skidyn.robots import base_parameter_index

ROBOT = load_planar_arm()


def recording(rate, duration=6.0):
    """Two joints that swing."""
    time = np.arange(0.0, duration, 1 / rate)
    phase = np.outer(time, [3.0, 4.7])
    states = np.sin(phase), np.cos(phase) * [3.0, 4.7], -np.sin(phase) * [9.0, 4.7**2]
    names = [f"{s}{j}" for s in ("q", "dq", "ddq") for j in (1, 2)]
    return pd.DataFrame(np.hstack(states), columns=names).assign(time=time)


def information(frame, rate):
    """Of a recording: each sample counts by its time, torque by its limit."""
    q, dq, ddq = (frame[[f"{s}1", f"{s}2"]].to_numpy() for s in ("q", "dq", "ddq"))
    regressor = ROBOT.torque_regressor(q, dq, ddq)[:, :, base_parameter_index(ROBOT)]
    friction = dq[:, :, None] * np.eye(2)
    columns = np.concatenate([regressor, friction], axis=2) / ROBOT.effort_limits[:, None]
    flat = columns.reshape(-1, columns.shape[2])
    return flat.T @ flat / rate


def told(recorded):
    """Motion that is designed to follow recordings, and its information."""
    motion = design_excitation(
        ROBOT, effects=("viscous",), recorded=recorded, duration=6.0, iterations=0
    )
    return motion, information(motion.to_frame(500.0), 500.0)


@pytest.mark.parametrize("rate", [100.0, 400.0])
@pytest.mark.parametrize("times", [1, 2])
def test_the_next_motion_is_judged_together_with_the_recordings(rate, times):
    """Recordings count by their length and not by their rate."""
    first = recording(rate)
    motion, own = told([first] * times)
    together = times * information(first, rate) + own
    assert motion.log_determinant == pytest.approx(np.linalg.slogdet(together)[1], abs=0.01)


def test_accelerations_that_were_not_recorded_are_derived():
    first = recording(400.0)
    derived, _ = told(first.drop(columns=["ddq1", "ddq2"]))
    assert derived.log_determinant == pytest.approx(told(first)[0].log_determinant, abs=0.05)


def test_a_designed_motion_counts_like_its_recording():
    first = design_excitation(ROBOT, duration=6.0, iterations=0)
    by_motion, by_table = (told(r)[0].log_determinant for r in (first, first.to_frame(100.0)))
    assert by_motion == pytest.approx(by_table, abs=0.02)


def test_the_next_motion_adds_what_the_recordings_lack():
    fast = {"duration": 6.0, "iterations": 3}
    alone = design_excitation(ROBOT, **fast)
    after = design_excitation(ROBOT, recorded=recording(100.0, 30.0), **fast)
    assert after.log_determinant > alone.log_determinant
    assert not np.allclose(after.weights, alone.weights)


def test_what_is_no_recording_is_refused():
    fast = {"duration": 6.0, "iterations": 0}
    with pytest.raises(SkidynError, match="no column 'time'"):
        design_excitation(ROBOT, recorded=recording(100.0).drop(columns="time"), **fast)
    with pytest.raises(SkidynError, match="recorded holds ndarray"):
        design_excitation(ROBOT, recorded=[np.zeros((5, 6))], **fast)
    with pytest.raises(SkidynError, match="cannot be designed for dahl: .* the motion before"):
        design_excitation(ROBOT, effects=[Term("dahl", (1,), {"presliding": 0.02})], **fast)
    with pytest.raises(SkidynError, match="stribeck has the shape parameter 'vs': give a Term"):
        design_excitation(ROBOT, effects=["stribeck"], **fast)
