# SPDX-License-Identifier: BSD-3-Clause
"""Windows on which networks are trained, as a callback of skorch sees them."""

import numpy as np
import pandas as pd
import pytest
from skorch.callbacks import Callback

from skidyn.neural_network import LSTMRegressor

WINDOW, STRIDE = 6, 4


class Recorder(Callback):
    """Inputs and targets of all batches, epoch by epoch."""

    def on_train_begin(self, net, **kwargs):
        self.epochs = []

    def on_epoch_begin(self, net, **kwargs):
        self.epochs.append([])

    def on_batch_begin(self, net, batch=None, training=None, **kwargs):
        self.epochs[-1].append([part.clone().numpy() for part in batch])


@pytest.fixture(scope="module", params=[False, True], ids=["one", "one per joint"])
def trained(request):
    """Signals and torque are the numbers of rows and trajectories, to know them in the windows."""
    owner = np.repeat([0, 1, 2, 3], [7, 1, 13, 16])
    row = np.arange(len(owner), dtype=float)
    X = pd.DataFrame({"trajectory": owner, "row": row, "owner": owner.astype(float)})
    weight = np.r_[np.zeros(10), np.ones(20), np.full(7, 2.0)]
    model = LSTMRegressor(
        window=WINDOW,
        stride=STRIDE,
        hidden_size=4,
        max_epochs=8,
        batch_size=2,
        per_joint=request.param,
        callbacks=[("recorder", Recorder())],
        random_state=0,
    ).fit(X, np.c_[row, row], sample_weight=weight)
    epochs = []
    for batches in dict(model.net_.callbacks_)["recorder"].epochs:
        members = [[], []] if request.param else [[]]
        for inputs, targets in batches:
            if not request.param:
                inputs, targets = inputs[None], targets[None]
            read = np.rint(inputs * model.input_scale_ + model.input_offset_).astype(int)
            wanted = targets[..., 0] * model.output_scale_[0] + model.output_offset_[0]
            for k, member in enumerate(members):
                member.append((read[k], np.rint(wanted[k]).astype(int), targets[k, ..., -1]))
        epochs += [[np.concatenate(parts) for parts in zip(*m, strict=True)] for m in members]
    return owner, weight, epochs


def test_every_row_with_a_weight_is_a_target_once_per_epoch(trained):
    _, weight, epochs = trained
    for _, wanted, weights in epochs:
        used = weights > 0
        order = np.argsort(wanted[used])
        np.testing.assert_array_equal(wanted[used][order], np.flatnonzero(weight))
        told = weights[used][order] / weight[weight > 0]
        np.testing.assert_allclose(told, told[0], rtol=1e-6)


def test_no_window_leaves_its_trajectory(trained):
    """Before its first row that row is repeated, as if the robot had rested there."""
    owner, _, epochs = trained
    first = np.searchsorted(owner, owner)
    for read, wanted, weights in epochs:
        for window, targets, own in zip(read, wanted, weights, strict=True):
            for k in np.flatnonzero(own > 0):
                row = targets[k]
                history = np.arange(row - WINDOW - k, row + 1)
                np.testing.assert_array_equal(window[: WINDOW + k + 1, 0], history.clip(first[row]))
                assert set(window[:, 1]) == {owner[row]}


def test_windows_are_cut_elsewhere_and_in_another_order_in_each_epoch(trained):
    _, _, epochs = trained
    starts = {tuple(wanted[:, 0]) for _, wanted, _ in epochs}
    assert len(starts) == len(epochs)
    assert len({tuple(sorted(s)) for s in starts}) > 2
