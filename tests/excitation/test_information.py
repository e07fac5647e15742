# SPDX-License-Identifier: BSD-3-Clause
"""What recordings tell, and how it adds up."""

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.effects import Term
from skidyn.exceptions import SkidynError
from skidyn.excitation import design_excitation
from skidyn.excitation._information import make_model, recorded_information
from skidyn.robots import base_parameter_index

ROBOT = load_planar_arm()


def recording(rate, duration=6.0):
    """Two joints that swing."""
    time = np.arange(0.0, duration, 1 / rate)
    phase = np.outer(time, [3.0, 4.7])
    states = np.sin(phase), np.cos(phase) * [3.0, 4.7], -np.sin(phase) * [9.0, 4.7**2]
    names = [f"{s}{j}" for s in ("q", "dq", "ddq") for j in (1, 2)]
    return pd.DataFrame(np.hstack(states), columns=names).assign(time=time)


def test_the_matrix_is_that_of_the_regressor():
    frame = recording(100.0)
    model = make_model(ROBOT, ("viscous",))
    q, dq, ddq = (frame[[f"{s}1", f"{s}2"]].to_numpy() for s in ("q", "dq", "ddq"))
    regressor = ROBOT.torque_regressor(q, dq, ddq)[:, :, base_parameter_index(ROBOT)]
    friction = dq[:, :, None] * np.eye(2)
    columns = np.concatenate([regressor, friction], axis=2) / ROBOT.effort_limits[:, None]
    flat = columns.reshape(-1, columns.shape[2])
    expected = flat.T @ flat / 100.0  # seconds for each sample
    np.testing.assert_allclose(recorded_information(model, frame), expected, rtol=1e-9, atol=1e-9)


def test_recordings_count_by_their_length_and_not_by_their_rate():
    model = make_model(ROBOT, None)
    slow, fast, long = (
        recorded_information(model, frame)
        for frame in (recording(100.0), recording(400.0), recording(100.0, 12.0))
    )
    scale = np.abs(slow).max()
    np.testing.assert_allclose(slow, fast, atol=0.02 * scale)
    assert np.trace(long) == pytest.approx(2 * np.trace(slow), rel=0.1)
    twice = recorded_information(model, [recording(100.0)] * 2)
    np.testing.assert_allclose(twice, 2 * slow)
    derived = recorded_information(model, recording(400.0).drop(columns=["ddq1", "ddq2"]))
    np.testing.assert_allclose(derived, fast, atol=0.05 * scale)


def test_a_designed_motion_counts_like_its_recording():
    first = design_excitation(ROBOT, duration=6.0, iterations=0)
    model = make_model(ROBOT, None)
    by_motion = recorded_information(model, first)
    by_table = recorded_information(model, first.to_frame(100.0))
    np.testing.assert_allclose(by_motion, by_table, atol=0.01 * np.abs(by_motion).max())


def test_the_next_motion_is_judged_together_with_the_recordings():
    first = recording(100.0, 30.0)
    fast = {"duration": 6.0, "iterations": 3}

    alone = design_excitation(ROBOT, **fast)
    after = design_excitation(ROBOT, recorded=first, **fast)

    model = make_model(ROBOT, None)
    together = recorded_information(model, [first, after.to_frame(500.0)])
    assert after.log_determinant == pytest.approx(np.linalg.slogdet(together)[1], abs=0.01)
    assert after.log_determinant > alone.log_determinant
    assert not np.allclose(after.weights, alone.weights)


def test_what_is_no_recording_is_refused():
    model = make_model(ROBOT, None)
    with pytest.raises(SkidynError, match="no column 'time'"):
        recorded_information(model, recording(100.0).drop(columns="time"))
    with pytest.raises(SkidynError, match="recorded holds ndarray"):
        recorded_information(model, [np.zeros((5, 6))])
    with pytest.raises(SkidynError, match="cannot be designed for dahl: .* the motion before"):
        make_model(ROBOT, [Term("dahl", (1,), {"presliding": 0.02})])
    with pytest.raises(SkidynError, match="stribeck has the shape parameter 'vs': give a Term"):
        make_model(ROBOT, ["stribeck"])
