# SPDX-License-Identifier: BSD-3-Clause
"""Work tells how far it is."""

from __future__ import annotations

import pytest

from skidyn._progress import listening
from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor

pandas = pytest.importorskip("pandas")
pty = pytest.importorskip("pty", reason="no terminals here")


def test_steps_of_a_diagnosis_are_known_while_it_runs():
    log = make_hidden_effect_log(load_planar_arm(), "stribeck", joints=[2], n_trajectories=3)
    told = []
    with listening(lambda text, share: told.append((text, share))):
        diagnose(RBDRegressor(log.robot), log.X, log.y)

    assert all(share is not None and 0 <= share <= 1 for _, share in told)
    stages = list(dict.fromkeys(text for text, _ in told))
    assert stages[:3] == ["Computing the rigid body", "Fitting", "Preparing effects"]
    assert {"Round 1: refining the best", "Round 2: screening effects"} <= set(stages)
    assert stages[-1] == "Judging what was found"
