# SPDX-License-Identifier: BSD-3-Clause
"""Errors of a comparison by joint, trajectory and regime."""

import numpy as np

from skidyn.diagnosis import REGIMES, error_map, regimes


def test_the_first_five_regimes_divide_the_samples(missing):
    where = regimes(missing.comparison)
    assert tuple(where) == REGIMES
    assert (sum(where[name].astype(int) for name in REGIMES[:5]) == 1).all()


def test_errors_of_regimes_add_up_to_that_of_the_joint(missing):
    comparison, where = missing.comparison, regimes(missing.comparison)
    shares = np.array([where[name].mean(axis=0) for name in REGIMES[:5]])
    parts = np.nan_to_num(error_map(comparison)[:, :5]) ** 2
    np.testing.assert_allclose(np.sum(parts.T * shares, axis=0), comparison.rmse() ** 2)


def test_a_row_for_every_joint_and_trajectory(missing, spring_log):
    table = missing.comparison.table()
    recordings = spring_log.X["trajectory"].unique()
    assert {(r["joint"], r["trajectory"]) for r in table} == {
        (j, int(k)) for j in (1, 2) for k in recordings
    }
    assert all(row["mae"] <= row["rmse"] for row in table)


def test_a_prediction_that_is_right_has_no_error(missing):
    exact = type(missing.comparison)(
        missing.comparison.signals, *2 * (missing.comparison.measured,),
        missing.comparison.sliding, missing.joint_names,
    )  # fmt: skip
    assert (exact.rmse() == 0).all() and (exact.rmse(judged=True) == 0).all()
