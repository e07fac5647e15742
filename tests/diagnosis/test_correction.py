# SPDX-License-Identifier: BSD-3-Clause
"""Better models of any estimator can be cloned, refitted and cross-validated."""

import numpy as np
import pandas as pd
import pytest
import sklearn
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.compose import TransformedTargetRegressor
from sklearn.linear_model import Ridge
from sklearn.metrics import make_scorer, r2_score
from sklearn.model_selection import GridSearchCV, GroupKFold, cross_val_score
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import FunctionTransformer, StandardScaler

import skidyn
from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import EffectSearchCV, diagnose
from skidyn.exceptions import EffectError
from skidyn.identification import RBDRegressor
from skidyn.model_selection import TrajectoryKFold
from skidyn.preprocessing import DropKeys, SmoothDerivatives

LOG = make_hidden_effect_log(
    load_planar_arm(), "spring", joints=[2], n_trajectories=6, duration=4.0
)
KINDS = ("spring",)


def kinds(diagnosis):
    return [(f.kind, f.joints) for f in diagnosis.findings]


def diagnosed(model, X=LOG.X, **options):
    """The log is as it should be: no test looks at its checks."""
    return diagnose(model, X, LOG.y, robot=LOG.robot, effects=KINDS, checks=(), **options)


@pytest.fixture(scope="module")
def of_ridge():
    return diagnosed(Ridge().fit(LOG.X, LOG.y))


def test_a_corrected_model_refits(of_ridge):
    diagnosis = of_ridge
    model = diagnosis.model if diagnosis.findings else diagnosis.add("spring", [2])
    again = clone(model).fit(LOG.X, LOG.y)
    np.testing.assert_allclose(again.predict(LOG.X), model.predict(LOG.X), atol=1e-6)
    assert len(cross_val_score(model, LOG.X, LOG.y, cv=TrajectoryKFold(2))) == 2


@pytest.mark.parametrize(
    "model",
    [
        pytest.param(
            GridSearchCV(
                RBDRegressor(LOG.robot), {"estimator": ["weighted"]}, cv=TrajectoryKFold(2)
            ),
            id="search",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            TransformedTargetRegressor(RBDRegressor(LOG.robot), transformer=StandardScaler()),
            id="target",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            Pipeline([("nothing", "passthrough"), ("model", RBDRegressor(LOG.robot))]),
            id="pipeline",
        ),
    ],
)
def test_models_inside_others_are_opened(model):
    diagnosis = diagnosed(model.fit(LOG.X, LOG.y))
    assert kinds(diagnosis) == [("spring", (2,))]
    expected = Pipeline if isinstance(model, Pipeline) else RBDRegressor
    assert isinstance(diagnosis.model, expected)
    before, after = (np.square(m.predict(LOG.X) - LOG.y).mean() for m in (model, diagnosis.model))
    assert after < before


@pytest.mark.parametrize(
    ("steps", "before"),
    [
        ([DropKeys(), Ridge()], []),
        pytest.param(
            [StandardScaler().set_output(transform="pandas"), DropKeys(), Ridge()],
            [],
            marks=pytest.mark.slow,
        ),
        pytest.param(
            [SmoothDerivatives(cutoff=8.0).set_output(transform="pandas"), DropKeys(), Ridge()],
            ["smoothderivatives"],
            marks=pytest.mark.slow,
        ),
    ],
    ids=["keys", "scaled", "derived"],
)
def test_effects_found_on_a_pipeline_return_a_pipeline(steps, before):
    X = LOG.X if not before else LOG.X.filter(regex=r"^(trajectory|time|q\d)")
    given = make_pipeline(*steps).fit(X, LOG.y)
    diagnosis = diagnosed(given, X)
    for model in (diagnosis.model, diagnosis.add("spring", [2])):
        assert isinstance(model, Pipeline)
        assert [name for name, _ in model.steps] == [*before, "ridge"]
    # what the user's own steps do stays inside; the effects see signals in their units, and keys
    by_hand = given.predict(X)
    signals = model[:-1].transform(X) if before else X
    added = model.predict(X) - by_hand
    q2 = np.asarray(signals["q2"], dtype=float)
    np.testing.assert_allclose(added[:, 0], 0.0, atol=1e-9)
    line = np.polynomial.Polynomial.fit(q2, added[:, 1], 1)(q2)
    np.testing.assert_allclose(added[:, 1], line, atol=1e-6)
    again = clone(model).fit(X, LOG.y)
    np.testing.assert_allclose(again.predict(X), model.predict(X), atol=1e-6)
    assert np.isfinite(cross_val_score(model, X, LOG.y, cv=TrajectoryKFold(2))).all()
    alpha = {"ridge__regressor__ridge__alpha": [0.1, 10.0]}
    search = GridSearchCV(model, alpha, cv=GroupKFold(2)).fit(X, LOG.y, groups=LOG.X["trajectory"])
    assert isinstance(search.best_estimator_, Pipeline)


@pytest.mark.slow
def test_weights_reach_the_steps_of_a_corrected_pipeline(tmp_path):
    weight = np.linspace(0.5, 1.5, len(LOG.X))
    given = make_pipeline(DropKeys(), Ridge()).fit(LOG.X, LOG.y)
    diagnosis = diagnosed(given, sample_weight=weight)
    assert diagnosis.findings
    model = clone(diagnosis.model).fit(LOG.X, LOG.y, ridge__sample_weight=weight)
    own = make_pipeline(DropKeys(), Ridge()).fit(LOG.X, LOG.y, ridge__sample_weight=weight)
    np.testing.assert_allclose(model[-1].regressor_[-1].coef_, own[-1].coef_, rtol=1e-12)
    stored = skidyn.load_model(skidyn.save_model(tmp_path / "corrected.skops", model))
    np.testing.assert_array_equal(stored.predict(LOG.X), model.predict(LOG.X))
    with sklearn.config_context(enable_metadata_routing=True):
        ridge = Ridge().set_fit_request(sample_weight=True)
        routed = clone(diagnosis.model).set_params(ridge__regressor__ridge=ridge)
        scores = cross_val_score(
            routed,
            LOG.X,
            LOG.y,
            cv=GroupKFold(2),
            params={"groups": LOG.X["trajectory"], "sample_weight": weight},
            # before scikit-learn 1.7 a Pipeline's own score asks for a request
            scoring=make_scorer(r2_score).set_score_request(sample_weight=True),
            error_score="raise",
        )
    assert np.isfinite(scores).all()


def test_a_corrected_model_is_diagnosed_with_its_effects(of_ridge):
    corrected = of_ridge.add("spring", [2])
    again = diagnosed(corrected)
    left = np.sqrt(np.mean((corrected.predict(LOG.X) - LOG.y) ** 2, axis=0))
    assert np.all(again.rmse_before < 1.5 * left)
    assert [t.kind for t in again.add("spring", [1]).effect_terms_] == ["spring", "spring"]


def test_open_shapes_are_found_and_effects_without_their_signals_refused(of_ridge):
    (term,) = of_ridge.add("dahl", [1]).effect_terms_
    assert term.shape["presliding"] > 0
    with pytest.raises(EffectError, match="needs its shape parameter N"):
        of_ridge.add("torque_ripple", [1])
    with pytest.raises(EffectError, match="needs joint temperatures"):
        of_ridge.add("temperature_offset")


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
    table = pd.DataFrame(results)
    assert {"mean_fit_time", "std_score_time", "param_model__effects"} < set(table)
    np.testing.assert_allclose(table[["rmse1", "rmse2"]].mean(axis=1), results["mean_rmse"])
    assert (table[["mean_fit_time", "mean_score_time"]] > 0).all(axis=None)
    assert search.refit_time_ > 0 and not search.multimetric_
    with pytest.raises(ValueError, match="has no parameter effects"):
        EffectSearchCV(Ridge()).fit(LOG.X, LOG.y)


def test_a_search_of_effects_stands_inside_other_searches():
    grid = GridSearchCV(RBDRegressor(LOG.robot), {"parameters": ["identified"]})
    target = TransformedTargetRegressor(RBDRegressor(LOG.robot))
    for outer in (grid, target, make_pipeline(grid)):
        with pytest.raises(ValueError, match="hides the parameter effects of the RBDRegressor"):
            EffectSearchCV(outer).fit(LOG.X, LOG.y)


def test_steps_without_a_state_learn_the_names_of_their_columns():
    step = FunctionTransformer(feature_names_out="one-to-one")
    pipeline = make_pipeline(step, RBDRegressor(LOG.robot))
    found = diagnosed(pipeline)
    assert isinstance(found.model, Pipeline)
    expected = diagnosed(RBDRegressor(LOG.robot))
    np.testing.assert_allclose(found.model.predict(LOG.X), expected.model.predict(LOG.X))


def test_names_for_a_model_that_is_not_physics_are_said_to_be_of_the_model():
    X, y = LOG.X, LOG.y

    class Bodies(RegressorMixin, BaseEstimator):
        """Predicts what a rigid body does, whatever it is fitted to."""

        def fit(self, X, y):
            self.bodies_ = RBDRegressor(LOG.robot).fit(X, y)
            return self

        def predict(self, X):
            return self.bodies_.predict(X)

    diagnosis = diagnosed(Bodies().fit(X, y))

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
