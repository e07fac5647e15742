# SPDX-License-Identifier: BSD-3-Clause
"""A measurement as checks see it."""

import numpy as np

from skidyn.measurement import Measurement


def test_joints_have_names_and_numbers(signals, torque):
    measurement = Measurement(signals, torque, None, ("shoulder", "elbow"))
    assert (measurement.n_joints, measurement.n_samples) == (2, len(torque))
    assert "elbow" in measurement.joint(1)
    assert measurement.joints([0, 1]) == "joint 1 (shoulder) and joint 2 (elbow)"


def test_trajectories_end_where_positions_leap(signals, torque):
    q = signals.q.copy()
    q[900:] += 2.0
    measurement = Measurement(signals.with_(q=q), torque, None, ("shoulder", "elbow"))
    assert measurement.leaps.tolist() == [900]
    assert np.flatnonzero(np.diff(measurement.signals.trajectory)).tolist() == [899]
