# SPDX-License-Identifier: BSD-3-Clause
"""Progress callbacks of scikit-learn, where it has them."""

import numpy as np
import pytest

from skidyn.neural_network import LSTMRegressor


def test_a_callback_follows_every_epoch_and_can_stop():
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
    X = np.random.default_rng(0).normal(size=(60, 2))
    model = LSTMRegressor(window=2, hidden_size=4, max_epochs=15, random_state=0)
    model.set_callbacks(StopAfterTwo()).fit(X, X)
    assert model.n_iter_ == 2 and epochs == ["epoch", "epoch", "fit"]
