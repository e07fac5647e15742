# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest
from sklearn.linear_model import LinearRegression, Ridge
from sklearn.metrics import mean_absolute_error, mean_squared_error, r2_score
from sklearn.model_selection import GridSearchCV, cross_validate

from skidyn.metrics import (
    SCORERS,
    joint_error_table,
    joint_scores,
    percent_improvement,
    rmse_over_range,
)


@pytest.fixture
def torques():
    rng = np.random.default_rng(0)
    true = rng.normal(size=(50, 3)) * [1.0, 10.0, 0.1]
    return true, true + 0.1 * rng.normal(size=true.shape)


def test_table_agrees_with_scikit_learn(torques):
    true, pred = torques
    table = joint_error_table(true, pred, joint_names=["a", "b", "c"])
    per_joint = {"multioutput": "raw_values"}
    for row, reference in (
        ("MSE", mean_squared_error(true, pred, **per_joint)),
        ("MAE", mean_absolute_error(true, pred, **per_joint)),
        ("R2", r2_score(true, pred, **per_joint)),
    ):
        np.testing.assert_allclose([table[row][name] for name in "abc"], reference)
        assert table[row]["mean"] == pytest.approx(np.mean(reference))


def test_errors_are_ordered_as_they_must_be(torques):
    table = joint_error_table(*torques)
    for joint in ("J1", "J2", "J3"):
        assert table["min"][joint] <= table["MAE"][joint]
        assert table["MAE"][joint] <= table["RMSE"][joint] <= table["max"][joint]


def test_range_of_the_whole_log_can_be_given(torques):
    true, pred = torques
    part = rmse_over_range(true[:5], pred[:5], torque_range=np.ptp(true, axis=0))
    assert part < rmse_over_range(true[:5], pred[:5])


def test_messages_name_the_joint_and_the_row():
    with pytest.raises(ValueError, match="joint 2 is constant and has no range"):
        rmse_over_range([[0.0, 1.0], [1.0, 1.0]], np.zeros((2, 2)))
    with pytest.raises(ValueError, match="y_pred is not finite in row 1"):
        rmse_over_range([0.0, 1.0], [0.0, np.nan])
    with pytest.raises(ValueError, match="shape"):
        rmse_over_range([0.0, 1.0], [[0.0, 1.0]])
    with pytest.raises(ValueError, match="not positive"):
        percent_improvement(0.0, 1.0)


def test_scorers_work_in_cross_validation(torques):
    true, pred = torques
    result = cross_validate(LinearRegression(), pred, true, scoring=SCORERS, cv=3)
    assert (result["test_neg_rmse_over_range"] <= 0).all()
    largest, mean = (
        result[f"test_neg_{name}"] for name in ("max_absolute_error", "mean_absolute_error")
    )
    assert (largest <= mean).all()


def test_every_joint_is_scored_and_the_mean_is_that_of_the_scorers(torques):
    true, pred = torques
    folds = {"X": pred, "y": true, "cv": 3}
    scores = cross_validate(LinearRegression(), scoring=joint_scores, **folds)
    expected = cross_validate(LinearRegression(), scoring=SCORERS, **folds)
    for name in SCORERS:
        np.testing.assert_allclose(scores[f"test_{name}"], expected[f"test_{name}"])
        per_joint = [scores[f"test_{name}_J{j}"] for j in (1, 2, 3)]
        np.testing.assert_allclose(np.mean(per_joint, axis=0), expected[f"test_{name}"])
    search = GridSearchCV(
        Ridge(), {"alpha": [1e-3, 1e3]}, scoring=joint_scores, refit="r2_J2", cv=3
    ).fit(pred, true)
    assert search.best_params_ == {"alpha": 1e-3}
