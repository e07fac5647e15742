# SPDX-License-Identifier: BSD-3-Clause
"""Training by skorch: callbacks, early stopping, divergence."""

import numpy as np
import pytest
import torch
from skorch.callbacks import Checkpoint, EarlyStopping

from skidyn.neural_network import LSTMRegressor, NDLRegressor

SMALL = {"window": 8, "hidden_size": 12, "max_epochs": 15, "random_state": 0}


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


def test_adamw_by_default_and_verbose(log, capsys):
    model = LSTMRegressor(**SMALL | {"max_epochs": 2}, optimizer__weight_decay=0.0, verbose=1)
    (group,) = model.fit(*log).net_.optimizer_.param_groups
    assert (group["weight_decay"], group["betas"]) == (0.0, (0.8, 0.95))
    assert "train_loss" in capsys.readouterr().out


def test_divergence_is_an_error(log):
    X, y = log
    with pytest.raises(ValueError, match="lower learning_rate"):
        LSTMRegressor(**SMALL | {"learning_rate": 1e30}).fit(X, y)


def test_a_diverging_network_is_told():
    rng = np.random.default_rng(0)
    X, y = rng.normal(size=(200, 6)), rng.normal(size=(200, 2))
    model = LSTMRegressor(window=3, hidden_size=4, max_epochs=3, learning_rate=1e30)
    with pytest.raises(ValueError, match="training diverged in epoch 1"):
        model.fit(X, y)
