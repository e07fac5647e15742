# SPDX-License-Identifier: BSD-3-Clause
"""Functions of the signals on which a joint's residual depends."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm


@pytest.mark.slow
def test_what_passes_on_another_share_of_torque_than_of_way_is_no_spring(arm_log, found_in):
    q = arm_log.X[["q1", "q2"]].to_numpy()
    torque = np.array(arm_log.y)
    pull = 0.5 * np.std(torque[:, 1]) * np.cos(q[:, 0] - q[:, 1])
    torque += pull[:, None] * [1.0, -0.5]

    assert found_in(load_planar_arm(), arm_log.X, torque) == {"unknown": {1, 2}}
