# SPDX-License-Identifier: BSD-3-Clause
"""The filter of what swings against SciPy's substitution for any order."""

import numpy as np
import pytest
from scipy.signal import bilinear

from skidyn.effects import get_effect


@pytest.mark.parametrize("damping", [0.02, 0.5])
def test_the_wind_up_of_a_link_of_constant_inertia_is_that_of_scipys_filter(signals, damping):
    from scipy.signal import lfilter, lfilter_zi

    omega = 2 * np.pi * 4.0
    effect = get_effect("joint_elasticity")
    found, *_ = effect.moves(signals, 1, resonance=4.0, damping=damping)
    for rows, step in zip(signals.segments, signals.steps, strict=True):
        b, a = bilinear([1.0], [1 / omega**2, 2 * damping / omega, 1.0], 1 / step)
        load = signals.load[rows, 1]  # the last one carries no other
        expected = lfilter(b, a, load, zi=lfilter_zi(b, a) * load[0])[0]
        np.testing.assert_allclose(found[rows], expected, rtol=1e-9, atol=1e-12)
