# SPDX-License-Identifier: BSD-3-Clause
"""Functions of the signals on which a joint's residual depends."""

import warnings

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


@pytest.mark.slow
def test_an_inertia_that_varies_is_found_with_coarse_positions(arm_log):
    """Where the residual is far above the noise that coarse positions cause."""
    robot, X, torque = load_planar_arm(), arm_log.X.copy(), np.array(arm_log.y)
    step = 2 * np.pi / 2**13
    drum = X["ddq1"] * X["q1"] ** 2
    torque[:, 0] += 0.4 * np.std(torque[:, 0]) * drum / np.std(drum)
    for name in ("q1", "q2"):
        X[name] = np.round(X[name] / step) * step
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = RBDRegressor(robot, effects=["viscous", "coulomb"])
        diagnosis = diagnose(model, X, torque, checks=())

    (finding,) = diagnosis.findings
    assert (finding.kind, finding.joints) == ("unknown", (1,))
    assert set(finding.variables) == {"q1", "ddq1"}


@pytest.mark.slow
def test_what_passes_on_another_share_of_torque_than_of_way_is_no_spring(arm_log, found_in):
    q = arm_log.X[["q1", "q2"]].to_numpy()
    torque = np.array(arm_log.y)
    pull = 0.5 * np.std(torque[:, 1]) * np.cos(q[:, 0] - q[:, 1])
    torque += pull[:, None] * [1.0, -0.5]

    assert found_in(load_planar_arm(), arm_log.X, torque) == {"unknown": {1, 2}}
