# SPDX-License-Identifier: BSD-3-Clause
"""What is wrong with the data is not taken for friction or a spring."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.exceptions import LogError
from skidyn.identification import RBDRegressor


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(load_planar_arm(), None, noise="high", random_state=8)


def found(log, X, torque):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        diagnosis = diagnose(RBDRegressor(log.robot), X, torque)
    said = " ".join([*diagnosis.warnings, *(str(w.message) for w in caught)])
    return [(f.kind, f.joints) for f in diagnosis.findings], said


def test_quantised_torque(log):
    step = 0.5 * np.std(log.y, axis=0)

    kinds, _ = found(log, log.X, np.round(log.y / step) * step)

    assert kinds == []


def test_a_few_broken_rows(log):
    torque = np.array(log.y)
    rng = np.random.default_rng(0)
    rows = rng.choice(len(torque), 20, replace=False)
    torque[rows] += 30 * rng.normal(size=(20, 2)) * np.std(torque, axis=0)

    kinds, said = found(log, log.X, torque)

    assert kinds == []
    assert "leaps away and back" in said


def test_rows_repeated_by_a_logger_that_polls_too_fast(log):
    X, torque = log.X.copy(), np.array(log.y)
    columns = ["q1", "q2", "dq1", "dq2"]
    late = np.arange(4, len(X), 7)
    X.loc[late, columns] = X.loc[late - 1, columns].to_numpy()
    torque[late] = torque[late - 1]

    kinds, said = found(log, X, torque)

    assert kinds == []
    assert "repeat" in said


def test_a_sensor_zeroed_anew_before_each_recording(log):
    shift = 0.6 * np.random.default_rng(1).normal(size=10)
    torque = np.array(log.y)
    torque[:, 1] += shift[log.X["trajectory"].to_numpy() - 1] * np.std(torque[:, 1])

    kinds, _ = found(log, log.X, torque)

    assert set(kinds) == {("offset", (2,))}  # one finding for every recording that differs


def test_a_torque_channel_that_lags(log):
    torque = np.array(log.y)
    for name in np.unique(log.X["trajectory"]):
        rows = np.flatnonzero(log.X["trajectory"] == name)
        torque[rows[2:]] = torque[rows[:-2]]

    kinds, _ = found(log, log.X, torque)

    assert [kind for kind, _ in kinds] == ["time_delay"]


def test_torque_cut_off_at_a_limit_is_said(log):
    limit = np.quantile(np.abs(log.y[:, 0]), 0.9)

    kinds, said = found(log, log.X, np.clip(log.y, [-limit, -np.inf], [limit, np.inf]))

    assert {kind for kind, _ in kinds} <= {"saturation"}
    assert "saturated" in said


def test_an_error_of_units_is_said_with_its_evidence(log):
    X = log.X.copy()
    X[["q1", "q2", "dq1", "dq2"]] = np.rad2deg(X[["q1", "q2", "dq1", "dq2"]])

    with pytest.raises(LogError, match="degrees.*--units q=deg,dq=deg/s"):
        found(log, X, log.y)
