# SPDX-License-Identifier: BSD-3-Clause
"""Nameless torques that are periodic in time."""

import numpy as np

from skidyn.effects import Term


def test_a_brake_that_drags_at_times_and_a_spring_that_breathes_are_periodic(signals, left_by):
    shape = {"frequency": 0.7}
    square = np.sign(np.sin(2 * np.pi * 0.7 * signals.time))
    friction = Term("pulsating_friction", (1,), shape).torque_columns(signals)[0]
    assert left_by(friction, square * signals.sign[:, 0]) < 0.4
    spring = Term("pulsating_spring", (1,), shape).torque_columns(signals)[0]
    wave = np.sin(2 * np.pi * 0.7 * signals.time + 0.3)
    assert left_by(spring, (signals.q[:, 0] + 0.5) * wave) < 1e-9
    assert left_by(spring, signals.sign[:, 0] * wave) > 0.3
    drag = Term("pulsating_drag", (1,), shape).torque_columns(signals)[0]
    assert left_by(drag, signals.dq[:, 0] * wave) < 1e-9


def test_a_wave_may_begin_anew_with_every_recording(signals, left_by):
    term = Term("clock_periodic", (1,), {"frequency": 0.7, "since_start": 1.0})
    wave = np.sin(2 * np.pi * 0.7 * signals.since_start + 0.3)
    assert left_by(term.torque_columns(signals)[0], wave) < 1e-9
    assert "since the start of each recording" in term.effect.words(term.shape)
