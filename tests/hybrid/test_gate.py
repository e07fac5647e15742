# SPDX-License-Identifier: BSD-3-Clause
"""What is learned is kept only where it is more than chance."""

import numpy as np
import pytest
from sklearn.ensemble import ExtraTreesRegressor
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import ShuffleSplit
from sklearn.neighbors import KNeighborsRegressor

from skidyn.hybrid import HybridRegressor, learned_weights
from skidyn.model_selection import PhaseKFold

FEATURES = ["q1", "q2", "dq1", "dq2"]  # what learners without key columns see
TREES = ExtraTreesRegressor(15, min_samples_leaf=5, random_state=0)


def test_p_values_are_corrected_for_the_number_of_joints():
    rng = np.random.default_rng(0)
    learned = rng.normal(size=(600, 1))
    residual = 0.5 * learned + rng.normal(size=(600, 1))
    unit = np.repeat(np.arange(6), 100)
    weight, gain, alone = learned_weights(residual, learned, unit, 0.05)
    noise = rng.normal(size=(600, 3))
    together = learned_weights(
        np.c_[residual, rng.normal(size=(600, 3))], np.c_[learned, noise], unit, 0.05
    )
    assert alone[0] < together[2][0] <= 4 * alone[0]
    assert 0 < weight[0] < (residual * learned).sum() / (learned**2).sum()  # less its error
    assert together[0][0] == weight[0] and not together[0][1:].any() and 0.05 < gain[0] < 0.2


def test_small_gains_on_many_joints_are_seen_together():
    rng = np.random.default_rng(1)
    learned = rng.normal(size=(600, 6))
    residual = 0.1 * learned + rng.normal(size=(600, 6))
    unit = np.repeat(np.arange(6), 100)
    alone = [learned_weights(residual[:, [j]], learned[:, [j]], unit, 0.05)[2] for j in range(6)]
    assert 6 * min(alone) > 0.05  # none would pass after correction
    assert (learned_weights(residual, learned, unit, 0.05)[0] > 0).sum() >= 3


def test_one_recording_proves_nothing(make_log):
    X, y = make_log(1, 1000)
    hybrid = HybridRegressor(LinearRegression(), TREES, cv=PhaseKFold(5, period=20.0))
    with pytest.warns(UserWarning, match="fewer than three trajectories"):
        hybrid.fit(X, y)
    assert not hybrid.learned_weight_.any() and (hybrid.p_value_ == 1).all()
    np.testing.assert_array_equal(hybrid.predict(X), hybrid.physics_.predict(X[FEATURES]))
    assert hybrid.set_params(alpha=1.0).fit(X, y).learned_weight_[0] > 0.5  # as the user asks
    with pytest.raises(ValueError, match="exactly once"):
        hybrid.set_params(cv=ShuffleSplit(2)).fit(X, y)


def test_a_learner_that_does_not_improve_is_told(make_log):
    X, y = make_log(8, 60, hidden=(0.0, 0.0))
    hybrid = HybridRegressor(LinearRegression(), TREES, cv=4)
    with pytest.warns(UserWarning, match=r"smallest p-value .*, alpha=0\.05"):
        hybrid.fit(X, y)
    assert hybrid.learner_ is None and not hybrid.learned_weight_.any()


@pytest.mark.filterwarnings("ignore:the learned part is left out")
def test_drift_between_recordings_is_not_taken_for_something_learned(make_log):
    kept = 0
    for seed in range(10):
        X, y = make_log(8, 60, seed=seed, hidden=(0.0, 0.0))
        level = np.random.default_rng(seed).normal(size=(8, 2))
        y += level[X["trajectory"].to_numpy()]
        hybrid = HybridRegressor(LinearRegression(), KNeighborsRegressor(5), cv=4).fit(X, y)
        kept += (hybrid.learned_weight_ > 0).any()
    assert kept <= 1
