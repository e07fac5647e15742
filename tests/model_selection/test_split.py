# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pandas as pd
import polars as pl
import pytest
from sklearn.linear_model import Ridge
from sklearn.model_selection import GridSearchCV, GroupKFold, cross_val_score

from skidyn.model_selection import PhaseKFold, TrajectoryKFold


@pytest.fixture
def table():
    rng = np.random.default_rng(0)
    frame = pd.DataFrame({"q1": rng.normal(size=60), "trajectory": np.repeat([5, 3, 9, 1], 15)})
    return frame, frame["q1"].to_numpy() + rng.normal(size=60)


def test_folds_are_those_of_group_k_fold_for_every_kind_of_table(table):
    X, y = table
    expected = cross_val_score(Ridge(), X, y, cv=GroupKFold(4), groups=X["trajectory"])
    for same, column in ((X, "trajectory"), (pl.from_pandas(X), "trajectory"), (X.to_numpy(), 1)):
        scores = cross_val_score(Ridge(), same, y, cv=TrajectoryKFold(4, trajectory=column))
        np.testing.assert_allclose(scores, expected, rtol=1e-12)


def test_grid_search_needs_no_groups(table):
    search = GridSearchCV(Ridge(), {"alpha": [0.1, 1.0]}, cv=TrajectoryKFold(2)).fit(*table)
    assert search.n_splits_ == 2


def test_messages_say_what_to_do(table):
    X, _ = table
    with pytest.raises(ValueError, match="X has\\s+4"):
        next(TrajectoryKFold(5).split(X))
    with pytest.raises(ValueError, match="a single trajectory.*PhaseKFold"):
        next(TrajectoryKFold(2).split(X.assign(trajectory=0)))
    with pytest.raises(ValueError, match="give its position"):
        next(TrajectoryKFold(2).split(X.to_numpy()))


def test_phase_folds_hold_out_every_repetition_with_a_guard():
    time = np.arange(0, 20, 0.01)
    X = pd.DataFrame({"time": time, "q1": np.sin(2 * np.pi * time / 10)})
    tested = []
    for train, test in PhaseKFold(4, period=10.0, guard=0.1).split(X):
        distance = np.abs((time[train][:, None] - time[test][None, ::10] + 5) % 10 - 5)
        assert distance.min() >= 0.1 - 1e-9
        assert (time[test] > 10).sum() == pytest.approx(len(test) / 2, abs=2)
        tested.append(test)
    np.testing.assert_array_equal(np.sort(np.concatenate(tested)), np.arange(len(time)))


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"period": 200.0}, "has no training rows"),
        ({"period": -2.0}, "above 0"),
        ({"period": 2.0, "guard": 5.0}, "has no training rows"),
        ({"n_splits": 1}, "at least 2"),
    ],
)
def test_phases_without_rows_are_refused(options, told):
    X = pd.DataFrame({"time": np.arange(0, 4, 0.01), "q1": 0.0})
    with pytest.raises(ValueError, match=told):
        list(PhaseKFold(**options).split(X))
