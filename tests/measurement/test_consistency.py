# SPDX-License-Identifier: BSD-3-Clause
"""A velocity is proportional to the change of its position."""

import numpy as np

from skidyn.measurement._consistency import velocity_consistency


def test_lost_samples_near_the_others_do_not_change_the_scale_of_a_velocity():
    t = np.arange(0, 10, 0.01)
    q = 0.1 + 0.05 * np.sin(2 * t)
    lost = np.random.default_rng(0).random(len(t)) < 0.004
    slope, likeness = velocity_consistency(
        t, np.where(lost, 0.0, q), 0.1 * np.cos(2 * t), [slice(0, len(t))]
    )
    assert abs(slope - 1) < 0.02 and likeness > 0.98
