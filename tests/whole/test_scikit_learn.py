# SPDX-License-Identifier: BSD-3-Clause
"""Every estimator inside scikit-learn's own tools gives the numbers of a hand-written loop."""

import pickle
import warnings
from functools import cache

import numpy as np
import pandas as pd
import pytest
import sklearn
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.compose import TransformedTargetRegressor
from sklearn.ensemble import BaggingRegressor, StackingRegressor, VotingRegressor
from sklearn.experimental import enable_halving_search_cv  # noqa: F401
from sklearn.inspection import PartialDependenceDisplay, partial_dependence, permutation_importance
from sklearn.linear_model import LinearRegression, Ridge
from sklearn.metrics import (
    make_scorer,
    mean_absolute_error,
    mean_squared_error,
    r2_score,
    root_mean_squared_error,
)
from sklearn.model_selection import (
    GridSearchCV,
    GroupKFold,
    HalvingGridSearchCV,
    LeaveOneGroupOut,
    RandomizedSearchCV,
    cross_val_predict,
    cross_val_score,
    cross_validate,
    learning_curve,
    train_test_split,
)
from sklearn.multioutput import MultiOutputRegressor
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import FunctionTransformer, StandardScaler
from sklearn.utils.fixes import parse_version

import skidyn
from skidyn.committee import ELMCommittee
from skidyn.diagnosis import EffectSearchCV
from skidyn.effects import FrictionTransformer, Term
from skidyn.exceptions import LogError
from skidyn.forecasting import AutoregressiveRegressor, PersistenceRegressor
from skidyn.hybrid import HybridRegressor, OwnJointRegressor
from skidyn.identification import RBDRegressor
from skidyn.model_selection import LeakageWarning, TrajectoryKFold
from skidyn.neural_network import BLLRegressor, LSTMRegressor, NDLRegressor, SDLRegressor
from skidyn.preprocessing import (
    ButterworthFilter,
    CurrentToTorque,
    DropKeys,
    SignalScaler,
    SmoothDerivatives,
    TimeDerivative,
)
from skidyn.robots import Robot

pytestmark = pytest.mark.usefixtures("diagnosed_once")
PENDULUM = Robot.from_urdf(
    '<robot name="pendulum"><link name="base"/><link name="rod"><inertial>'
    '<origin xyz="0.2 0 0"/><mass value="1.5"/>'
    '<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    '<joint name="j1" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>'
    '<limit lower="-3" upper="3" effort="50" velocity="3"/></joint></robot>'
)
NET = {"window": 2, "hidden_size": 4, "max_epochs": 1, "random_state": 0}
LSTM = LSTMRegressor(**NET)
#: Each estimator, and a parameter to search. A network first: its task loads torch, see
#: fresh_processes.
REGRESSORS = {
    "LSTM": (LSTM, {"hidden_size": [2, 4]}),
    "RBD": (RBDRegressor(PENDULUM), {"parameters": ["identified", "nominal"]}),
    "OwnJoint": (OwnJointRegressor(Ridge()), {"estimator__alpha": [0.1, 100.0]}),
    "Hybrid": (HybridRegressor(RBDRegressor(PENDULUM), Ridge(), cv=2), {"alpha": [0.05, 1.0]}),
    "ELM": (ELMCommittee(2, n_hidden=10, random_state=0), {"p": [0.5, 0.9]}),
    "NDL": (NDLRegressor(**NET, dense_size=3), {"optimizer__weight_decay": [0.0, 0.05]}),
    "SDL": (SDLRegressor(PENDULUM, **NET, cv=2), {"residual": [True, False]}),
    "BLL": (BLLRegressor(LSTM, n_estimators=2, random_state=0), {"estimator__window": [1, 2]}),
    "Search": (
        EffectSearchCV(RBDRegressor(PENDULUM), effects=(), cv=2),
        {"estimator__parameters": ["identified", "nominal"]},
    ),
    "AR": (AutoregressiveRegressor(3), {"order": [1, 3]}),
    "Persistence": (PersistenceRegressor(), {"trajectory": ["trajectory", "auto"]}),
}
TRANSFORMERS = [
    DropKeys(),
    FrictionTransformer(),
    ButterworthFilter(5.0),
    TimeDerivative(),
    SmoothDerivatives(),
    SignalScaler(),
    CurrentToTorque(101, 0.125),
]
#: Steps that look at neighbours in time.
SEQUENTIAL = (ButterworthFilter, TimeDerivative, SmoothDerivatives)
# Every transformer as a step before a regressor of scikit-learn.
REGRESSORS |= {
    type(step).__name__: (make_pipeline(step, Ridge()), {"ridge__alpha": [0.1, 100.0]})
    for step in TRANSFORMERS
}
SCORERS = {
    "r2": r2_score,
    "neg_mean_absolute_error": lambda y, p: -mean_absolute_error(y, p),
    "neg_mean_squared_error": lambda y, p: -mean_squared_error(y, p),
    "neg_root_mean_squared_error": lambda y, p: -root_mean_squared_error(y, p),
}
SAME = {"rtol": 1e-9, "atol": 1e-9}


def make_log(n_trajectories=4, n_rows=100):
    """A pendulum with friction."""
    t, frames = np.arange(n_rows) * 0.02, []
    for k in range(n_trajectories):
        speed = 2.0 + 0.7 * k
        q, dq, ddq = np.sin(speed * t), speed * np.cos(speed * t), -(speed**2) * np.sin(speed * t)
        frames.append(pd.DataFrame({"trajectory": k, "time": t, "q1": q, "dq1": dq, "ddq1": ddq}))
    X = pd.concat(frames, ignore_index=True)
    y = PENDULUM.inverse_dynamics(*(X[[s]].to_numpy() for s in ("q1", "dq1", "ddq1")))[:, 0]
    noise = np.random.default_rng(0).normal(size=len(X))
    return X, 1.2 * y + 0.5 * np.tanh(X["dq1"].to_numpy() / 0.05) + 0.05 * noise


X, Y = make_log()
GROUPS = X["trajectory"].to_numpy()
SPLITS = list(GroupKFold(2).split(X, Y, GROUPS))
#: The torque one sample ago, for forecasts.
BEFORE = np.where(np.diff(GROUPS, prepend=-1) == 0, np.roll(Y, 1), Y)
PAST = X[["trajectory", "time"]].assign(q1=BEFORE)


def table_of(model):
    """Log of the kind that an estimator reads."""
    if isinstance(model, AutoregressiveRegressor | PersistenceRegressor):
        return PAST
    derives = isinstance(model, Pipeline) and isinstance(
        model[0], TimeDerivative | SmoothDerivatives
    )
    return X.drop(columns="ddq1") if derives else X


def needs_order(model):
    """Whether rows must stand in the order of time."""
    first = model[0] if isinstance(model, Pipeline) else model
    return isinstance(first, (EffectSearchCV, AutoregressiveRegressor, *SEQUENTIAL))


@pytest.fixture(params=REGRESSORS)
def model(request):
    return clone(REGRESSORS[request.param][0])


@pytest.fixture
def grid(request, model):
    return REGRESSORS[request.node.callspec.params["model"]][1]


@pytest.fixture(autouse=True)
def remarks():
    """Two trajectories are few for a hybrid, and some of these tools shuffle rows."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "the learned part is left out")
        warnings.simplefilter("ignore", LeakageWarning)
        yield


def by_hand(model, splits=SPLITS, score=r2_score):
    """Scores of a plain loop over folds."""
    X = table_of(model)
    return [
        score(Y[test], clone(model).fit(X.iloc[train], Y[train]).predict(X.iloc[test]))
        for train, test in splits
    ]


@cache
def scores_of(name):
    """Scores of a regressor by its name, with which several tools are compared."""
    return by_hand(clone(REGRESSORS[name][0]))


@pytest.fixture
def scores_by_hand(request, model):
    return scores_of(request.node.callspec.params["model"])


def test_cross_validate_with_four_scorers(model):
    X = table_of(model)
    found = cross_validate(model, X, Y, groups=GROUPS, cv=GroupKFold(2), scoring=list(SCORERS))
    fitted = [clone(model).fit(X.iloc[train], Y[train]) for train, _ in SPLITS]
    for name, score in SCORERS.items():
        expected = [
            score(Y[test], m.predict(X.iloc[test]))
            for m, (_, test) in zip(fitted, SPLITS, strict=True)
        ]
        np.testing.assert_allclose(found[f"test_{name}"], expected, **SAME)


def test_leave_one_group_out_and_learning_curve(model, scores_by_hand):
    X = table_of(model)
    cv = LeaveOneGroupOut()
    scores = cross_val_score(model, X, Y, groups=GROUPS, cv=cv)
    np.testing.assert_allclose(scores, by_hand(model, cv.split(X, Y, GROUPS)), **SAME)
    sizes, _, scores = learning_curve(model, X, Y, cv=SPLITS, train_sizes=[0.5, 1.0])
    assert len(sizes) == 2
    half = [(train[: sizes[0]], test) for train, test in SPLITS]
    np.testing.assert_allclose(scores, [by_hand(model, half), scores_by_hand], **SAME)


def test_searches(model, grid):
    X = table_of(model)
    (name, values), *_ = grid.items()
    expected = [np.mean(by_hand(clone(model).set_params(**{name: value}))) for value in values]
    every = {"cv": TrajectoryKFold(2), "refit": False}
    search = GridSearchCV(model, grid, **every).fit(X, Y)
    np.testing.assert_allclose(search.cv_results_["mean_test_score"], expected, **SAME)
    search = RandomizedSearchCV(model, grid, n_iter=2, random_state=0, **every).fit(X, Y)
    order = [values.index(p[name]) for p in search.cv_results_["params"]]
    np.testing.assert_allclose(search.cv_results_["mean_test_score"], np.take(expected, order))
    epochs = isinstance(model, LSTMRegressor | SDLRegressor)
    limits = {"min_resources": 2, "max_resources": 4} if epochs else {"min_resources": len(X) // 2}
    resource = "max_epochs" if epochs else "n_samples"
    halving = HalvingGridSearchCV(model, grid, resource=resource, factor=2, **limits, **every)
    if needs_order(model):  # it draws single rows, in which no motion is left
        with pytest.raises(ValueError, match=r"(?s)not in the order of time.*HalvingGridSearchCV"):
            halving.fit(X, Y)
        return
    found = halving.fit(X, Y).cv_results_
    assert np.isfinite(found["mean_test_score"]).all()
    if epochs:
        own = [clone(model).set_params(**p) for p in found["params"]]
        own = [m.set_params(max_epochs=n) for m, n in zip(own, found["n_resources"], strict=True)]
        expected = [np.mean(by_hand(m)) for m in own]
        np.testing.assert_allclose(found["mean_test_score"], expected, **SAME)
    else:  # the last round has all rows, in another order
        last = np.mean(by_hand(clone(model).set_params(**found["params"][-1])))
        np.testing.assert_allclose(found["mean_test_score"][-1], last, rtol=1e-6)


def test_inside_other_estimators(model):
    X = table_of(model)
    own = clone(model).fit(X, Y).predict(X)
    other = LinearRegression().fit(X, Y)
    for table in ("default", "pandas", "polars"):
        step = FunctionTransformer(feature_names_out="one-to-one").set_output(transform=table)
        np.testing.assert_allclose(make_pipeline(step, model).fit(X, Y).predict(X), own, **SAME)
    voting = VotingRegressor([("a", model), ("b", LinearRegression())]).fit(X, Y)
    np.testing.assert_allclose(voting.predict(X), (own + other.predict(X)) / 2, **SAME)
    stacking = StackingRegressor([("a", model)], LinearRegression(), cv=TrajectoryKFold(2))
    held_out = cross_val_predict(model, X, Y, cv=SPLITS)[:, None]
    expected = LinearRegression().fit(held_out, Y).predict(own[:, None])
    np.testing.assert_allclose(stacking.fit(X, Y).predict(X), expected, **SAME)
    scaled = TransformedTargetRegressor(model, transformer=StandardScaler()).fit(X, Y)
    by_loop = clone(model).fit(X, (Y - Y.mean()) / Y.std()).predict(X) * Y.std() + Y.mean()
    np.testing.assert_allclose(scaled.predict(X), by_loop, rtol=1e-6, atol=1e-6)
    if not isinstance(model, RBDRegressor):  # one joint alone tells no bodies
        many = MultiOutputRegressor(model).fit(X, np.c_[Y, 2 * Y])
        np.testing.assert_allclose(many.predict(X)[:, 0], own, **SAME)


def test_bagging(model):
    at, named = {"trajectory": 0, "time": 1}, {}  # it hands arrays down
    for name in model.get_params():
        key = name.rpartition("__")[2]
        if key in at:
            named[name] = at[key]
    bag = BaggingRegressor(clone(model).set_params(**named), 2, random_state=0)
    table = table_of(model).to_numpy()
    weighs = isinstance(model, EffectSearchCV)
    if needs_order(model) and not weighs:  # it takes no weights, so that rows are drawn
        with pytest.raises(LogError, match="not in the order of time.*BaggingRegressor"):
            bag.fit(table, Y)
        return
    members = [member.predict(table) for member in bag.fit(table, Y).estimators_]
    np.testing.assert_allclose(bag.predict(table), np.mean(members, axis=0), **SAME)


def test_inspection(model):
    X = table_of(model)
    model.fit(X, Y)
    if isinstance(model, Pipeline) and needs_order(model):  # it shuffles the time as well
        with pytest.raises(LogError, match="not in the order of time"):
            permutation_importance(model, X, Y, n_repeats=1, random_state=0)
    else:
        found = permutation_importance(model, X, Y, n_repeats=1, random_state=0).importances[:, 0]
        seed, order = np.random.RandomState(0).randint(2**31), np.arange(len(X))
        np.random.RandomState(seed).shuffle(order)
        shuffled = [X.assign(**{name: X[name].to_numpy()[order]}) for name in X]
        expected = [model.score(X, Y) - model.score(table, Y) for table in shuffled]
        np.testing.assert_allclose(found, expected, **SAME)
    found = partial_dependence(model, X, ["q1"], grid_resolution=3)
    expected = [model.predict(X.assign(q1=value)).mean() for value in found["grid_values"][0]]
    np.testing.assert_allclose(found["average"][0], expected, **SAME)
    shown = PartialDependenceDisplay.from_estimator(model, X, ["q1"], grid_resolution=3)
    np.testing.assert_allclose(shown.pd_results[0]["average"][0], expected, **SAME)


def test_shuffled_rows(model):
    X = table_of(model)
    train, test, y_train, _ = train_test_split(X, Y, random_state=0)
    if needs_order(model):
        with pytest.raises(LogError, match="not in the order of time, as after train_test_split"):
            model.fit(train, y_train)
        return
    assert np.isfinite(clone(model).fit(train, y_train).predict(test)).all()
    assert np.isfinite(clone(model).fit(train[:40], y_train[:40]).predict(test)).all()


@pytest.mark.parametrize(
    "transformer",
    [
        ButterworthFilter(5.0),
        TimeDerivative(),
        SmoothDerivatives(),
        FrictionTransformer([Term("dahl", (1,), {"presliding": 0.01})]),
    ],
    ids=lambda t: type(t).__name__,
)
def test_steps_that_need_a_sequence_refuse_shuffled_rows(transformer):
    derives = isinstance(transformer, TimeDerivative | SmoothDerivatives)
    table = X.drop(columns="ddq1") if derives else X
    train, _ = train_test_split(table, random_state=0)
    with pytest.raises(LogError, match=r"not in the order of time.*TrajectoryKFold"):
        clone(transformer).fit_transform(train)
    assert np.isfinite(clone(transformer).fit_transform(table)).all()


def test_copies_files_and_single_precision(model, tmp_path):
    X = table_of(model)
    expected = model.fit(X, Y).predict(X)
    np.testing.assert_array_equal(clone(model).fit(X, Y).predict(X), expected)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(model)).predict(X), expected)
    stored = skidyn.save_model(tmp_path / "model.skops", model)
    np.testing.assert_allclose(skidyn.load_model(stored).predict(X), expected, **SAME)
    polars = pytest.importorskip("polars").from_pandas(X)
    np.testing.assert_allclose(model.predict(polars), expected, **SAME)
    single = clone(model).fit(X.astype(np.float32), Y.astype(np.float32))
    error = single.predict(X.astype(np.float32)) - expected
    assert np.sqrt(np.mean(error**2)) < 0.05 * Y.std()


@pytest.mark.slow
def test_two_processes(model, scores_by_hand, fresh_processes):
    X = table_of(model)
    scores = cross_val_score(model, X, Y, cv=SPLITS, n_jobs=2)
    np.testing.assert_allclose(scores, scores_by_hand, **SAME)


def test_metadata_routing():
    weight = np.random.default_rng(0).uniform(0.5, 1.5, len(X))
    for name in ("RBD", "OwnJoint", "Hybrid", "ELM", "LSTM", "SDL"):
        model = REGRESSORS[name][0]
        expected = []
        for train, test in SPLITS:
            fitted = clone(model).fit(X.iloc[train], Y[train], sample_weight=weight[train])
            expected.append(r2_score(Y[test], fitted.predict(X.iloc[test])))
        with sklearn.config_context(enable_metadata_routing=True):
            routed = clone(model)
            scores = cross_val_score(
                make_pipeline(FunctionTransformer(), routed),
                X,
                Y,
                cv=GroupKFold(2),
                params={"sample_weight": weight, "groups": GROUPS},
                scoring=make_scorer(r2_score).set_score_request(sample_weight=False),
                error_score="raise",
            )
        np.testing.assert_allclose(scores, expected, **SAME)


def test_a_score_of_its_own_takes_the_weights_too():
    weight = np.random.default_rng(0).uniform(0.5, 1.5, len(X))
    model = REGRESSORS["RBD"][0]
    expected = []
    for train, test in SPLITS:
        fitted = clone(model).fit(X.iloc[train], Y[train], sample_weight=weight[train])
        expected.append(fitted.score(X.iloc[test], Y[test], sample_weight=weight[test]))
    with sklearn.config_context(enable_metadata_routing=True):
        sent = {"sample_weight": weight, "groups": GROUPS}
        scores = cross_val_score(model, X, Y, cv=GroupKFold(2), params=sent, error_score="raise")
    np.testing.assert_allclose(scores, expected, **SAME)


class Spy(RegressorMixin, BaseEstimator):
    """Says which columns it was given."""

    def fit(self, X, y):
        self.columns_ = X.shape[1]
        self.mean_ = np.mean(y)
        return self

    def predict(self, X):
        assert X.shape[1] == self.columns_
        return np.full(len(X), self.mean_)


@pytest.mark.parametrize(
    ("learner", "columns"),
    [
        (Spy(), 3),
        (make_pipeline(StandardScaler(), Spy()), 3),
        (make_pipeline(DropKeys(), StandardScaler(), Spy()), 3),
        (make_pipeline(FrictionTransformer(), Spy()), 5),
        (make_pipeline(SignalScaler(), StandardScaler(), Spy()), 3),
        pytest.param(
            VotingRegressor([("own", OwnJointRegressor(Ridge())), ("spy", Spy())]),
            3,
            marks=pytest.mark.skipif(
                parse_version(sklearn.__version__) < parse_version("1.7"),
                reason="this VotingRegressor in a bag gives weights to members that take none",
            ),
        ),
    ],
)
@pytest.mark.parametrize("table", [X, X.to_numpy()], ids=["names", "positions"])
def test_key_columns_never_reach_learners(learner, columns, table):
    keys = {} if table is X else {"trajectory": 0, "time": 1}
    own = {
        n: keys[n.rpartition("__")[2]] for n in learner.get_params() if n.split("__")[-1] in keys
    }
    learner = clone(learner).set_params(**own)
    inside = {"cv": 2, "alpha": 1.0, **keys}
    physics = RBDRegressor(PENDULUM, **keys)
    fitted = [
        HybridRegressor(learner, Ridge(), **inside).fit(table, Y).physics_,
        BLLRegressor(learner, n_estimators=1, **keys).fit(table, Y).bagging_.estimators_[0],
    ]
    kept = HybridRegressor(physics, learner, **inside).fit(table, Y).learner_
    for model in fitted + [kept] * (kept is not None):
        while not isinstance(model, Spy):
            model = model[-1] if isinstance(model, Pipeline) else model.estimators_[-1]
        assert model.columns_ == columns


@pytest.mark.parametrize(
    "transformer",
    TRANSFORMERS,
    ids=lambda t: type(t).__name__,
)
@pytest.mark.parametrize("tables", ["pandas", "polars"])
def test_transformers(transformer, tables, tmp_path):
    pytest.importorskip(tables)
    table = X[["q1"]] if isinstance(transformer, CurrentToTorque) else X
    if isinstance(transformer, TimeDerivative | SmoothDerivatives):
        table = X.drop(columns="ddq1")
    plain = clone(transformer).fit_transform(table)
    framed = clone(transformer).set_output(transform=tables).fit_transform(table)
    assert list(framed.columns) == list(clone(transformer).fit(table).get_feature_names_out())
    np.testing.assert_allclose(np.asarray(framed), np.asarray(plain), **SAME)
    fitted = clone(transformer).fit(table)
    stored = skidyn.save_model(tmp_path / "model.skops", fitted)
    for copy in (pickle.loads(pickle.dumps(fitted)), skidyn.load_model(stored)):
        np.testing.assert_allclose(np.asarray(copy.transform(table)), np.asarray(plain), **SAME)
    pipeline = make_pipeline(transformer, Ridge())
    scores = cross_val_score(pipeline, table, Y, cv=SPLITS)
    expected = [
        r2_score(
            Y[test],
            Ridge()
            .fit(clone(transformer).fit_transform(table.iloc[train]), Y[train])
            .predict(clone(transformer).fit(table.iloc[train]).transform(table.iloc[test])),
        )
        for train, test in SPLITS
    ]
    np.testing.assert_allclose(scores, expected, **SAME)


def test_effect_search():
    table, torque = make_log(6, 200)
    torque = torque + 1.5 * table["q1"].to_numpy()
    search = EffectSearchCV(RBDRegressor(PENDULUM), effects=("spring",), cv=2)
    groups = table["trajectory"].to_numpy()
    splits = list(GroupKFold(2).split(table, torque, groups))
    fitted = [clone(search).fit(table.iloc[train], torque[train]) for train, _ in splits]
    expected = [
        r2_score(torque[test], m.predict(table.iloc[test]))
        for m, (_, test) in zip(fitted, splits, strict=True)
    ]
    scores = cross_val_score(search, table, torque, groups=groups, cv=GroupKFold(2))
    np.testing.assert_allclose(scores, expected, **SAME)
    again = pickle.loads(pickle.dumps(fitted[0]))
    np.testing.assert_allclose(again.predict(table), fitted[0].predict(table), **SAME)
    assert fitted[0].best_params_["effects"] and fitted[0].cv_results_["rank_test_score"].min() == 1
    model = fitted[0].best_estimator_
    assert PartialDependenceDisplay.from_estimator(model, table, ["q1"], grid_resolution=3)
