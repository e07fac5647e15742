# SPDX-License-Identifier: BSD-3-Clause
"""Steps of a coarse sensor."""

import numpy as np

from skidyn._sensor_steps import position_step

WAVE = np.sin(np.arange(2000) * 0.01)


def test_the_step_of_a_coarse_sensor_is_found_and_none_is_made_up():
    assert np.isclose(position_step(np.round(WAVE / 0.01) * 0.01), 0.01)
    assert np.isnan(position_step(WAVE + 1e-4 * np.random.default_rng(0).normal(size=2000)))
