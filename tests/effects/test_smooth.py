# SPDX-License-Identifier: BSD-3-Clause
"""Smooth functions of a signal."""

import numpy as np
import pytest

from skidyn.effects import Term


@pytest.mark.parametrize(
    ("kind", "name", "torque"),
    [
        ("function_of_position", "q", lambda x: np.sin(7 * x)),
        ("function_of_velocity", "dq", lambda x: x * np.exp(-(x**2))),
    ],
)
def test_splines_follow_their_signal_and_no_other(signals, left_by, kind, name, torque):
    x = getattr(signals, name)[:, 0]
    columns = Term(kind, (1,), {"low": x.min(), "high": x.max()}).torque_columns(signals)[0]
    assert left_by(columns, torque(x)) < 0.01
    assert left_by(columns, np.sin(3 * signals.time)) > 0.5
