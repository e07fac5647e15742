# SPDX-License-Identifier: BSD-3-Clause
"""A joint that rests throughout takes nothing from what the others show."""

from __future__ import annotations

import warnings

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


def test_an_effect_is_found_beside_a_joint_that_rests():
    robot, rng = load_planar_arm(), np.random.default_rng(0)
    tables, torques = [], []
    for trajectory in range(8):
        t = np.arange(0, 8, 0.01)
        a, w = rng.normal(size=(2, 3)), 2 * np.pi * np.array([0.2, 0.45, 0.7])
        phase = np.outer(t, w)
        q2 = 0.6 * (np.sin(phase) @ a[0] + np.cos(phase) @ a[1])
        dq2 = 0.6 * (np.cos(phase) @ (a[0] * w) - np.sin(phase) @ (a[1] * w))
        ddq2 = -0.6 * (np.sin(phase) @ (a[0] * w**2) + np.cos(phase) @ (a[1] * w**2))
        still = np.zeros_like(q2)
        q, dq, ddq = (np.column_stack([still, x]) for x in (q2, dq2, ddq2))
        tau = robot.inverse_dynamics(q, dq, ddq)
        tau[:, 1] += 0.4 * dq2 + 0.6 * np.tanh(dq2 / 0.01) + 1.5 * (q2 - 0.2)
        tau += 0.02 * rng.normal(size=tau.shape)
        frame = {"time": t, "trajectory": trajectory, "q1": q[:, 0], "q2": q2}
        tables.append(pd.DataFrame(frame | {"dq1": still, "dq2": dq2}))
        torques.append(tau)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that it rests is said too
        diagnosis = diagnose(RBDRegressor(robot), pd.concat(tables), np.vstack(torques))

    assert [(f.kind, f.joints) for f in diagnosis.findings] == [("spring", (2,))]
    assert np.isfinite(diagnosis.rmse_after).all()
    assert 0 <= diagnosis.findings[0].q_value < 1e-6


def test_a_robot_that_rests_is_refused_by_a_sentence():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=4, duration=4.0)
    X = log.X.copy()
    moving = [c for c in X.columns if c[0] in "dq" and c[-1].isdigit()]
    X[moving] = 0.0
    y = 0.3 + 0.01 * np.random.default_rng(2).normal(size=np.shape(log.y))

    with pytest.raises(ValueError, match="no joint slides long enough"):
        diagnose(RBDRegressor(log.robot), X, y)
