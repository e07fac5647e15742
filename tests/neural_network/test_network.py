# SPDX-License-Identifier: BSD-3-Clause
"""Networks one after another."""

import torch
from skorch.callbacks import Callback

from skidyn.neural_network import NDLRegressor


class Twins(Callback):
    """Outputs of two networks of the same weights for the same input, in training and after it."""

    def on_train_begin(self, net, **kwargs):
        module = net.module_
        with torch.no_grad():
            for parameter in module.parameters():
                parameter[1] = parameter[0]
            x = torch.ones(2, 4, module.window + 3, module.n_inputs)
            self.training = module.train()(x)
            self.evaluated = module.eval()(x)
        module.train()


def test_members_drop_units_of_their_own(log):
    model = NDLRegressor(
        window=3,
        dense_size=8,
        dropout=0.5,
        per_joint=True,
        max_epochs=1,
        callbacks=[("twins", Twins())],
        random_state=7,
    ).fit(*log)
    twins = dict(model.net_.callbacks_)["twins"]
    assert len(twins.training) == 2 and not torch.equal(*twins.training)
    assert torch.equal(*twins.evaluated)
