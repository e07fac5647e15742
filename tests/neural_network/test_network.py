# SPDX-License-Identifier: BSD-3-Clause
"""Networks one after another."""

import torch

from skidyn.neural_network._network import LSTMNetwork
from skidyn.neural_network._stacked import StackedNetwork


def test_members_drop_units_of_their_own():
    members = [LSTMNetwork(3, 2, 1, 5, 8, 0.5, seed=7) for _ in range(2)]
    members[1].dropout.seed = 8
    stacked = StackedNetwork(members)
    x = torch.ones(2, 4, 3, 3)
    assert not torch.equal(*stacked(x))
    stacked.eval()
    assert torch.equal(*stacked(x))
