# SPDX-License-Identifier: BSD-3-Clause
import pickle

import numpy as np
import pandas as pd
import polars as pl
import pytest
import torch
from sklearn.base import clone
from sklearn.ensemble import BaggingRegressor, ExtraTreesRegressor
from sklearn.model_selection import GridSearchCV, GroupKFold, cross_val_predict, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import parametrize_with_checks
from skorch import NeuralNet
from skorch.callbacks import Callback, Checkpoint, EarlyStopping, GradientNormClipping

from skidyn.exceptions import ColumnError
from skidyn.model_selection import LeakageWarning, TrajectoryKFold
from skidyn.neural_network import BLLRegressor, LSTMRegressor, NDLRegressor

SMALL = {"window": 8, "hidden_size": 12, "max_epochs": 15, "random_state": 0}

SEQUENCE = {
    "check_methods_sample_order_invariance": "the order of rows is time, so it matters",
    "check_methods_subset_invariance": "a row is predicted from the rows before it as well",
    "check_sample_weight_equivalence_on_dense_data": (
        "a removed row is missing from the history of its successors, a row of weight 0 is not"
    ),
}


class Recorder(Callback):
    """A user's own callback."""

    def on_train_begin(self, net, **kwargs):
        self.losses = []

    def on_epoch_end(self, net, **kwargs):
        self.losses.append(net.history[-1, "train_loss"])


@parametrize_with_checks(
    [
        LSTMRegressor(
            window=3, stride=3, hidden_size=8, max_epochs=40, learning_rate=0.03, random_state=0
        ),
        NDLRegressor(
            window=3,
            stride=3,
            hidden_size=8,
            dropout=0,
            max_epochs=40,
            learning_rate=0.03,
            random_state=0,
        ),
    ],
    expected_failed_checks=lambda estimator: SEQUENCE,
)
def test_scikit_learn_contract(estimator, check):
    check(estimator)


def test_learns_what_needs_memory(make_log):
    X, y = make_log(n_trajectories=18)
    cv = TrajectoryKFold(2)
    model = LSTMRegressor(**SMALL | {"max_epochs": 40, "learning_rate": 0.02})
    recurrent = cross_val_score(model, X, y, cv=cv).mean()
    static = cross_val_score(ExtraTreesRegressor(20, random_state=0), X, y, cv=cv).mean()
    assert recurrent > 0.95 and 1 - recurrent < 0.5 * (1 - static)


def test_prediction_depends_on_the_past_of_the_segment_alone(log):
    X, y = log
    model = LSTMRegressor(**SMALL).fit(X, y)
    whole = model.predict(X)
    assert whole.dtype == np.float64 and whole.shape == y.shape
    for n in (1, 60, 121, 500):
        np.testing.assert_allclose(model.predict(X[:n]), whole[:n], atol=1e-6)
    alone = X["trajectory"] == 3
    np.testing.assert_allclose(model.predict(X[alone]), whole[alone], atol=1e-6)
    # a gap in time separates as a new trajectory number does
    gap = X[X["trajectory"] == 0].copy()
    gap.loc[60:, "time"] += 9.0
    np.testing.assert_allclose(model.predict(gap)[60:], model.predict(gap[60:]), atol=1e-6)


@pytest.mark.parametrize(("step", "stride"), [(1, 8), (5, 3), (8, 8), (37, 20)])
def test_stream_gives_the_numbers_of_the_whole_log(log, step, stride):
    X, y = log
    model = LSTMRegressor(**SMALL | {"max_epochs": 2, "stride": stride}).fit(X, y)
    X = X[:260]
    stream = model.stream()
    parts = [stream.predict(X[i : i + step]) for i in range(0, len(X), step)]
    np.testing.assert_allclose(np.concatenate(parts), model.predict(X), atol=1e-5)
    assert len(stream._past) <= model.window + 2 * model.stride


def test_bit_equal_for_any_number_of_processes_and_global_state_untouched(log):
    X, y = log[0].to_numpy(), log[1]
    member = NDLRegressor(**SMALL | {"max_epochs": 2}, trajectory=0, time=1, resample="trajectory")
    before = torch.get_rng_state()
    one, two = (
        BaggingRegressor(member, 2, bootstrap=False, random_state=0, n_jobs=n).fit(X, y).predict(X)
        for n in (1, 2)
    )
    np.testing.assert_array_equal(one, two)
    assert torch.equal(before, torch.get_rng_state())


@pytest.mark.skipif(not torch.cuda.is_available(), reason="torch sees no GPU")
@pytest.mark.parametrize("kind", [LSTMRegressor, NDLRegressor])
def test_a_gpu_learns_what_a_cpu_learns(kind, log):
    X, y = log
    there = kind(**SMALL, device="cuda").fit(X, y)
    torque = there.predict(X)
    np.testing.assert_allclose(there.set_params(device="cpu").predict(X), torque, atol=1e-3)
    here = kind(**SMALL).fit(X, y)
    errors = [np.sqrt(np.mean((np.asarray(y) - p) ** 2)) for p in (torque, here.predict(X))]
    assert errors[0] < 1.2 * errors[1]


def test_rows_of_weight_zero_are_not_learned_but_read(log):
    X, y = log
    spoiled = y.copy()
    out = (X["trajectory"] >= 6).to_numpy()
    spoiled[out] += 1000.0
    model = LSTMRegressor(**SMALL)
    weighted = clone(model).fit(X, spoiled, sample_weight=(~out).astype(float))
    assert np.abs(weighted.predict(X) - y).mean() < 1.0


@pytest.mark.parametrize("kind", [LSTMRegressor, NDLRegressor])
def test_early_stopping_and_checkpoint_of_skorch(kind, log, tmp_path):
    X, y = log
    noise = np.random.default_rng(0).normal(size=(len(X[::3]), 2))
    best = Checkpoint(dirname=tmp_path, load_best=True)
    model = kind(**SMALL | {"max_epochs": 200}, callbacks=[EarlyStopping(patience=3), best])
    model.fit(X[::3], noise)
    assert model.n_iter_ == len(model.validation_curve_) < 200
    assert (tmp_path / "params.pt").exists()
    # the weights of the best epoch
    stored = torch.load(tmp_path / "params.pt", weights_only=True)
    for name, tensor in model.net_.module_.state_dict().items():
        assert torch.equal(tensor, stored[name])
    assert len(model.net_.history) == 1 + int(np.argmin(model.validation_curve_))
    one = X["trajectory"] == 0
    assert model.fit(X[one], y[one]).n_iter_ > 0
    with pytest.raises(ValueError, match="too few"):
        model.fit(X[:1], y[:1])


def test_parameters_named_as_in_skorch(log):
    X, y = log
    model = NDLRegressor(
        **SMALL | {"max_epochs": 3},
        callbacks=[("recorder", Recorder()), GradientNormClipping(1.0)],
        optimizer=torch.optim.SGD,
        optimizer__momentum=0.9,
        module__dense_size=5,
    )
    search = GridSearchCV(model, {"optimizer__momentum": [0.0, 0.5]}, cv=TrajectoryKFold(2))
    assert search.fit(X, y).best_params_["optimizer__momentum"] in (0.0, 0.5)
    net = model.fit(X, y).net_
    epochs = dict(net.callbacks_)["recorder"].losses
    assert isinstance(net, NeuralNet) and net.initialized_ and len(net.history) == len(epochs) == 3
    assert net.optimizer_.param_groups[0]["momentum"] == 0.9
    assert net.module_.dense.out_features == net.get_params()["module__dense_size"] == 5
    # predictions are those of the net: weights that are put into it count
    before = model.predict(X)
    with torch.no_grad():
        net.module_.output.bias += 1.0
    np.testing.assert_allclose(model.predict(X), before + model.output_scale_, rtol=1e-5)
    again = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(again.predict(X), model.predict(X))
    assert again.net_.initialized_
    with pytest.raises(TypeError, match="no parameter 'momentum'"):
        NDLRegressor(momentum=0.9)
    with pytest.raises(ValueError, match="no parameter 'layers'"):
        NDLRegressor(module__layers=2).fit(X, y)


def test_adamw_by_default_and_verbose(log, capsys):
    model = LSTMRegressor(**SMALL | {"max_epochs": 2}, optimizer__weight_decay=0.0, verbose=1)
    (group,) = model.fit(*log).net_.optimizer_.param_groups
    assert (group["weight_decay"], group["betas"]) == (0.0, (0.8, 0.95))
    assert "train_loss" in capsys.readouterr().out


def test_shuffled_rows_are_sorted_with_a_warning(log):
    X, y = log
    model = LSTMRegressor(**SMALL | {"max_epochs": 2})
    expected = model.fit(X, y).predict(X)
    order = np.random.default_rng(0).permutation(len(X))
    with pytest.warns(LeakageWarning, match="predicts a row from the rows before it"):
        shuffled = clone(model).fit(X.iloc[order], y[order])
    np.testing.assert_array_equal(shuffled.predict(X), expected)
    np.testing.assert_array_equal(shuffled.predict(X.iloc[order]), expected[order])


def test_tables_pipelines_and_searches(log):
    X, y = log
    model = LSTMRegressor(**SMALL | {"max_epochs": 3})
    expected = model.fit(X, y).predict(X)
    polars = pl.from_pandas(X)
    np.testing.assert_array_equal(clone(model).fit(polars, y).predict(polars), expected)
    velocities = [k for k, name in enumerate(X) if name.startswith("dq")]
    by_position = model.set_params(trajectory=0, time=1, direction=velocities)
    by_position.fit(X.to_numpy(), y)
    np.testing.assert_array_equal(by_position.predict(X.to_numpy()), expected)
    assert "LSTMRegressor" in model._repr_html_()
    pipeline = make_pipeline(StandardScaler().set_output(transform="pandas"), clone(model))
    pipeline.set_params(lstmregressor__trajectory="trajectory", lstmregressor__time=None)
    search = GridSearchCV(pipeline, {"lstmregressor__window": [2, 8]}, cv=TrajectoryKFold(2))
    assert search.fit(X, y).best_params_["lstmregressor__window"] in (2, 8)
    by_group = cross_val_predict(pipeline, X, y, cv=GroupKFold(2), groups=X["trajectory"])
    np.testing.assert_array_equal(
        by_group, cross_val_predict(pipeline, X, y, cv=TrajectoryKFold(2))
    )


def test_the_direction_of_velocities_is_an_input():
    rng = np.random.default_rng(0)
    X = pd.DataFrame({"trajectory": np.repeat(np.arange(4), 150), "dq1": rng.normal(size=600)})
    X["dq1"] += 3.0  # a turn is rare, and far from the mean
    y = np.sign(X["dq1"].to_numpy())
    named = LSTMRegressor(max_epochs=40, random_state=0).fit(X, y)
    assert named.weights_[0]["lstm.weight_ih_l0"].shape[1] == 2
    numbered = LSTMRegressor(max_epochs=40, random_state=0, trajectory=0, direction=[1])
    np.testing.assert_array_equal(
        numbered.fit(X.to_numpy(), y).predict(X.to_numpy()), named.predict(X)
    )
    without = LSTMRegressor(max_epochs=40, random_state=0, direction=None).fit(X, y)
    assert without.weights_[0]["lstm.weight_ih_l0"].shape[1] == 1
    assert named.score(X, y) > max(0.9, without.score(X, y))
    with pytest.raises(ColumnError, match="dq2"):
        LSTMRegressor(direction=["dq2"]).fit(X, y)
    bagged = BLLRegressor(LSTMRegressor(max_epochs=1), n_estimators=1, random_state=0).fit(X, y)
    assert bagged.bagging_.estimators_[0].direction == [1]


def test_the_linear_path_reaches_beyond_the_training_range():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(600, 2))
    with_path, without = (
        LSTMRegressor(linear=linear, random_state=0).fit(X, X @ [2.0, -1.0])
        for linear in (True, False)
    )
    far = 3.0 * rng.normal(size=(200, 2))
    assert with_path.score(far, far @ [2.0, -1.0]) > max(0.9, without.score(far, far @ [2.0, -1.0]))


def test_one_network_per_joint_ignores_the_other_joints(log):
    X, y = log
    model = LSTMRegressor(**SMALL | {"max_epochs": 3}, per_joint=True)
    both = model.fit(X, y).predict(X)
    first = clone(model).fit(X, y * [1.0, -7.0]).predict(X)
    np.testing.assert_array_equal(both[:, 0], first[:, 0])


def test_stored_as_plain_arrays(log):
    X, y = log
    model = NDLRegressor(**SMALL | {"max_epochs": 2}, per_joint=True).fit(X, y)
    expected = model.predict(X)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(model)).predict(X), expected)
    skops = pytest.importorskip("skops.io")
    text = skops.dumps(model)
    types = skops.get_untrusted_types(data=text)
    assert all(name.startswith("skidyn.") for name in types)
    np.testing.assert_array_equal(skops.loads(text, trusted=types).predict(X), expected)


def test_callback_follows_every_epoch_and_can_stop(log):
    callback = pytest.importorskip("sklearn.callback")
    epochs = []

    class StopAfterTwo:
        def setup(self, estimator, context): ...
        def teardown(self, estimator, context): ...
        def on_fit_task_begin(self, estimator, context, **kwargs): ...

        def on_fit_task_end(self, estimator, context, **kwargs):
            epochs.append(context.task_name)
            return len(epochs) == 2

    assert isinstance(StopAfterTwo(), callback.FitCallback)
    model = LSTMRegressor(**SMALL).set_callbacks(StopAfterTwo()).fit(*log)
    assert model.n_iter_ == 2 and epochs == ["epoch", "epoch", "fit"]


def test_divergence_is_an_error(log):
    X, y = log
    with pytest.raises(ValueError, match="lower learning_rate"):
        LSTMRegressor(**SMALL | {"learning_rate": 1e30}).fit(X, y)
