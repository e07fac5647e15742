# SPDX-License-Identifier: BSD-3-Clause
"""Better models of any estimator can be cloned, refitted and cross-validated."""

import numpy as np
import pytest
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.compose import TransformedTargetRegressor
from sklearn.linear_model import Ridge
from sklearn.model_selection import GridSearchCV, GroupKFold, cross_val_score
from sklearn.pipeline import Pipeline
from sklearn.preprocessing import StandardScaler

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import EffectSearchCV, diagnose
from skidyn.identification import RBDRegressor
from skidyn.model_selection import TrajectoryKFold

LOG = make_hidden_effect_log(
    load_planar_arm(), "spring", joints=[2], n_trajectories=6, duration=6.0
)
KINDS = ("spring",)


def kinds(diagnosis):
    return [(f.kind, f.joints) for f in diagnosis.findings]


def test_a_corrected_model_refits():
    diagnosis = diagnose(Ridge().fit(LOG.X, LOG.y), LOG.X, LOG.y, robot=LOG.robot, effects=KINDS)
    model = diagnosis.model if diagnosis.findings else diagnosis.add("spring", [2])
    again = clone(model).fit(LOG.X, LOG.y)
    np.testing.assert_allclose(again.predict(LOG.X), model.predict(LOG.X), atol=1e-6)
    assert len(cross_val_score(model, LOG.X, LOG.y, cv=TrajectoryKFold(2))) == 2


@pytest.mark.parametrize(
    "model",
    [
        GridSearchCV(RBDRegressor(LOG.robot), {"estimator": ["weighted"]}, cv=TrajectoryKFold(2)),
        TransformedTargetRegressor(RBDRegressor(LOG.robot), transformer=StandardScaler()),
        Pipeline([("nothing", "passthrough"), ("model", RBDRegressor(LOG.robot))]),
    ],
    ids=["search", "target", "pipeline"],
)
def test_models_inside_others_are_opened(model):
    diagnosis = diagnose(model.fit(LOG.X, LOG.y), LOG.X, LOG.y, effects=KINDS)
    assert kinds(diagnosis) == [("spring", (2,))]
    expected = Pipeline if isinstance(model, Pipeline) else RBDRegressor
    assert isinstance(diagnosis.model, expected)
    before, after = (np.square(m.predict(LOG.X) - LOG.y).mean() for m in (model, diagnosis.model))
    assert after < before


def test_the_search_is_one_of_scikit_learn():
    search = EffectSearchCV(
        Pipeline([("smooth", "passthrough"), ("model", RBDRegressor(LOG.robot))]),
        effects=KINDS,
        cv=GroupKFold(3),
        scoring="neg_mean_absolute_error",
    )
    search = clone(search).fit(LOG.X, LOG.y, groups=LOG.X["trajectory"])
    results = search.cv_results_
    assert results["mean_test_score"].shape == results["rank_test_score"].shape == (2,)
    assert search.best_score_ == results["mean_test_score"][1] > results["mean_test_score"][0]
    assert results["rank_test_score"].tolist() == [2, 1]
    assert [str(t) for t in search.best_params_["model__effects"][2:]] == [
        str(t) for t in search.best_effects_
    ]
    best = clone(search.estimator).set_params(**search.best_params_).fit(LOG.X, LOG.y)
    np.testing.assert_allclose(best.predict(LOG.X), search.predict(LOG.X), atol=1e-6)
    assert list(search.feature_names_in_) == list(LOG.X.columns)
    assert not hasattr(EffectSearchCV(RBDRegressor(LOG.robot), refit=False), "predict")
    with pytest.raises(ValueError, match="takes no effects"):
        EffectSearchCV(Ridge()).fit(LOG.X, LOG.y)


def test_names_for_a_model_that_is_not_physics_are_said_to_be_of_the_model():
    X, y = LOG.X, LOG.y

    class Bodies(RegressorMixin, BaseEstimator):
        """Predicts what a rigid body does, whatever it is fitted to."""

        def fit(self, X, y):
            self.bodies_ = RBDRegressor(LOG.robot).fit(X, y)
            return self

        def predict(self, X):
            return self.bodies_.predict(X)

    diagnosis = diagnose(Bodies().fit(X, y), X, y, robot=LOG.robot, effects=KINDS)

    assert any("not a rigid-body model" in note for note in diagnosis.warnings)
    (finding,) = diagnosis.findings
    by_hand = []
    for train, test in GroupKFold(4).split(y, groups=X["trajectory"]):
        own = Bodies().fit(X.iloc[train], y[train])
        added = type(diagnosis.model)(own, LOG.robot, finding.terms)
        better = added.fit_effects(X.iloc[train], y[train]).predict(X.iloc[test])
        pairs = [(model - y[test]) ** 2 for model in (own.predict(X.iloc[test]), better)]
        by_hand.append([pair[:, 1].sum() for pair in pairs])
    before, after = np.sum(by_hand, axis=0)
    np.testing.assert_allclose(finding.error_drop, 1 - after / before, rtol=1e-6)
