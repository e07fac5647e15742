# SPDX-License-Identifier: BSD-3-Clause
"""Parameters named as in skorch."""

import pickle

import numpy as np
import pytest
import torch
from sklearn.model_selection import GridSearchCV
from skorch import NeuralNet
from skorch.callbacks import Callback, GradientNormClipping

from skidyn.model_selection import TrajectoryKFold
from skidyn.neural_network import NDLRegressor

SMALL = {"window": 8, "hidden_size": 12, "max_epochs": 15, "random_state": 0}


class Recorder(Callback):
    """A user's own callback."""

    def on_train_begin(self, net, **kwargs):
        self.losses = []

    def on_epoch_end(self, net, **kwargs):
        self.losses.append(net.history[-1, "train_loss"])


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
