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


def test_friction_over_position_vanishes_at_rest(signals):
    rest = signals.with_(dq=np.zeros_like(signals.dq))
    columns = Term("friction_over_position", (1,)).torque_columns(rest)[0]
    assert (columns == 0).all()
