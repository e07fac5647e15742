# SPDX-License-Identifier: BSD-3-Clause
"""Currents become torques."""

import numpy as np
import pytest

from skidyn.preprocessing import CurrentToTorque


def test_current_becomes_torque_and_back():
    current = np.array([[1.0, -2.0]])
    model = CurrentToTorque([101, 50], 0.1)
    torque = model.fit_transform(current)
    np.testing.assert_allclose(torque, [[10.1, -10.0]])
    np.testing.assert_allclose(model.inverse_transform(torque), current)
    with pytest.raises(ValueError, match="give 3 gains for 2 joints"):
        CurrentToTorque([1, 2, 3]).fit(current)
