# SPDX-License-Identifier: BSD-3-Clause
"""A robot against itself, healthy and changed."""

import numpy as np
import pandas as pd
import pytest
from sklearn.linear_model import LinearRegression

from skidyn.exceptions import SkidynError
from skidyn.metrics import Drift, drift

FOLDS = [(np.arange(100), np.arange(100, 200)), (np.arange(100, 200), np.arange(100))]


@pytest.fixture
def recording():
    rng = np.random.default_rng(1)
    X = rng.normal(size=(200, 3))
    return X, X[:, :2] + 0.1 * rng.normal(size=(200, 2))


def test_the_ratio_is_one_on_the_same_robot_and_large_on_a_changed_joint(recording):
    X, y = recording
    same = drift(LinearRegression(), X, y, X, y, folds=FOLDS)
    assert same.ratio == pytest.approx([1, 1], abs=0.1)
    changed = y + [0.0, 1.0] * X[:, 1:]
    result = drift(LinearRegression(), X, changed, X, y, folds=FOLDS)
    assert result.drifted(1.5).tolist() == [False, True]


def test_only_samples_that_count_are_judged(recording):
    X, y = recording
    broken = y.copy()
    broken[::2, 0] += 10
    use = np.ones_like(y, bool)
    moves = use.copy()
    moves[::2, 0] = False
    result = drift(LinearRegression(), X, broken, X, y, moving=(moves, use), folds=FOLDS)
    assert result.ratio[0] == pytest.approx(1, abs=0.2)


def test_a_joint_that_never_moves_is_told(recording):
    X, y = recording
    none = np.zeros_like(y, bool)
    with pytest.raises(SkidynError, match="joint 1 never moves"):
        drift(LinearRegression(), X, y, X, y, moving=(none, none), folds=FOLDS)


def test_drift_is_a_result_by_itself():
    assert Drift(np.array([2.0]), np.array([3.0])).ratio.tolist() == [1.5]


def test_a_reference_of_few_trajectories_needs_folds(recording):
    with pytest.raises(SkidynError, match="give folds="):
        drift(LinearRegression(), *recording, *recording)
    X, y = recording
    few = pd.DataFrame(X, columns=["q1", "q2", "q3"]).assign(trajectory=np.arange(200) // 70)
    with pytest.raises(SkidynError, match="X has 3.; give a reference with a column") as error:
        drift(LinearRegression(), few, y, few, y)
    assert "n_splits, or" not in str(error.value)
