# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest
from sklearn.linear_model import Ridge

from skidyn.model_selection import trajectory_learning_curve


@pytest.fixture
def data():
    rng = np.random.default_rng(0)
    X = np.c_[np.repeat(np.arange(6), 10), rng.normal(size=(60, 8))]
    return X, X[:, 1:] @ rng.normal(size=(8, 2)) + 0.5 * rng.normal(size=(60, 2))


@pytest.mark.slow
def test_more_trajectories_help_and_the_curve_is_reproducible(data):
    kwargs = {"trajectory": 0, "cv": 3, "n_trajectories": [1, 4], "random_state": 0}
    curve = trajectory_learning_curve(Ridge(), *data, **kwargs)
    assert curve.test_scores[1].mean() > curve.test_scores[0].mean()
    again = trajectory_learning_curve(Ridge(), *data, n_jobs=2, **kwargs)
    np.testing.assert_array_equal(curve.test_scores, again.test_scores)


def test_sizes_are_checked(data):
    assert trajectory_learning_curve(
        Ridge(), *data, trajectory=0, cv=3
    ).n_trajectories.tolist() == [1, 2, 4]
    with pytest.raises(ValueError, match="between 1 and 4"):
        trajectory_learning_curve(Ridge(), *data, trajectory=0, cv=3, n_trajectories=[9])
