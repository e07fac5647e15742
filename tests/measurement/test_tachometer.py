# SPDX-License-Identifier: BSD-3-Clause
"""Velocities without sign, with an offset, or clipped."""

import numpy as np
import pytest


@pytest.mark.parametrize(
    ("fault", "words", "remedy"),
    [
        (np.abs, "has no sign", "--derive dq2"),
        (lambda dq: dq + 0.3, "has an offset of 0.3 rad/s", "--zero dq2=0.3"),
        (lambda dq: np.clip(dq, -0.8, 0.8), "is clipped at 0.8 rad/s", "--derive dq2"),
    ],
)
def test_a_fault_of_one_velocity(fault, words, remedy, signals, torque, found):
    dq = np.column_stack([signals.dq[:, 0], fault(signals.dq[:, 1])])
    told = [s for s in found(signals.with_(dq=dq), torque) if s.check == "velocity"]
    assert [s.joints for s in told] == [(2,)]
    assert words in told[0].suspicion and told[0].remedy.option.startswith(remedy)


def test_a_velocity_with_noise_has_no_fault(signals, torque, found):
    noisy = signals.dq + np.random.default_rng(0).normal(0, 0.1, signals.dq.shape)
    assert "velocity" not in [s.check for s in found(signals.with_(dq=noisy), torque)]
