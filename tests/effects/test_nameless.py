# SPDX-License-Identifier: BSD-3-Clause
"""Nameless functions can take the form of any smooth torque of their signals."""

import numpy as np
import pytest

from skidyn.effects import Term


def left_by(columns, torque):
    """Share of the size of a torque that columns cannot take."""
    fit = columns @ np.linalg.lstsq(columns, torque, rcond=None)[0]
    return float(np.std(torque - fit) / np.std(torque))


@pytest.mark.parametrize(
    ("kind", "name", "torque"),
    [
        ("function_of_position", "q", lambda x: np.sin(7 * x)),
        ("function_of_velocity", "dq", lambda x: x * np.exp(-(x**2))),
    ],
)
def test_splines_follow_their_signal_and_no_other(signals, kind, name, torque):
    x = getattr(signals, name)[:, 0]
    columns = Term(kind, (1,), {"low": x.min(), "high": x.max()}).torque_columns(signals)[0]
    assert left_by(columns, torque(x)) < 0.01
    assert left_by(columns, np.sin(3 * signals.time)) > 0.5


def test_a_push_during_motion_is_a_function_of_position_and_velocity(signals):
    q, dq = signals.q[:, 0], signals.dq[:, 0]
    shape = {"low": q.min(), "high": q.max()}
    columns = Term("function_of_position_and_velocity", (1,), shape).torque_columns(signals)[0]
    assert left_by(columns, np.abs(dq) * (q - 0.2)) < 1e-9
    assert left_by(columns, q) > 0.3


def test_a_brake_that_drags_at_times_and_a_spring_that_breathes_are_periodic(signals):
    shape = {"frequency": 0.7}
    square = np.sign(np.sin(2 * np.pi * 0.7 * signals.time))
    friction = Term("pulsating_friction", (1,), shape).torque_columns(signals)[0]
    assert left_by(friction, square * signals.sign[:, 0]) < 0.4
    spring = Term("pulsating_spring", (1,), shape).torque_columns(signals)[0]
    wave = np.sin(2 * np.pi * 0.7 * signals.time + 0.3)
    assert left_by(spring, (signals.q[:, 0] + 0.5) * wave) < 1e-9
    assert left_by(spring, signals.sign[:, 0] * wave) > 0.3


def test_friction_over_position_vanishes_at_rest(signals):
    rest = signals.with_(dq=np.zeros_like(signals.dq))
    columns = Term("friction_over_position", (1,)).torque_columns(rest)[0]
    assert (columns == 0).all()
