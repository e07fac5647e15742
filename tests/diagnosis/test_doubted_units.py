# SPDX-License-Identifier: BSD-3-Clause
"""After a warning about units no physics is named."""

import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.exceptions import LogWarning
from skidyn.identification import RBDRegressor


def test_no_physics_is_named_while_a_unit_is_in_doubt():
    arm = load_planar_arm()
    log = make_hidden_effect_log(arm, "spring", n_trajectories=8, duration=6.0, random_state=3)
    X = log.X.assign(time=1.5 * log.X["time"])  # the clock, or velocities at another scale

    told = (
        r"measurement is in doubt \(.*scale of the clock.*\), so that no physical effect is named"
    )
    with pytest.warns(LogWarning, match=told):
        doubted = diagnose(RBDRegressor(arm, effects=["viscous", "coulomb"]), X, log.y)

    assert {(check.check, check.certainty) for check in doubted.checks} == {
        ("clock_unit", "suspected")
    }
    assert {finding.kind for finding in doubted.findings} == {"unknown"}
