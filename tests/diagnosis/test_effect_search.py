# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
from sklearn.base import clone

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import EffectSearchCV
from skidyn.identification import RBDRegressor


def test_finds_adds_and_predicts_better():
    log = make_hidden_effect_log(
        load_planar_arm(), "spring", joints=[2], n_trajectories=6, duration=6.0
    )
    start = RBDRegressor(log.robot)
    search = clone(EffectSearchCV(start, effects=("spring", "dahl"))).fit(log.X, log.y)
    assert [(t.kind, t.joints) for t in search.best_effects_] == [("spring", (1,))]
    assert search.cv_results_["added"].tolist() == [None, "spring"]
    assert np.all(np.diff(search.cv_results_["mean_rmse"]) < 0)
    assert search.score(log.X, log.y) > start.fit(log.X, log.y).score(log.X, log.y)
    assert not hasattr(search.estimator, "coef_")
