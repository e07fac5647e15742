# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest
import torch

from skidyn.neural_network._network import LSTMNetwork, Members, from_arrays
from skidyn.neural_network._stacked import StackedNetwork


@pytest.fixture(params=[0, 4], ids=["plain", "dense"])
def networks(request):
    return [LSTMNetwork(3, 2, 4, 5, request.param, seed=seed) for seed in range(3)]


def test_outputs_and_gradients_are_those_of_torch(networks):
    generator = torch.Generator().manual_seed(0)
    x = torch.randn(3, 6, 7, 3, generator=generator)
    outer = torch.randn(3, 6, 3, 2, generator=generator)
    stacked, members = StackedNetwork(networks), Members(networks)
    torch.testing.assert_close(stacked(x), members(x))
    (stacked(x) * outer).sum().backward()
    (members(x) * outer).sum().backward()
    for k, network in enumerate(networks):
        lstm, own = network.lstm, stacked.lstm.grad[k].mT
        torch.testing.assert_close(own[:, :3], lstm.weight_ih_l0.grad)
        torch.testing.assert_close(own[:, 3], lstm.bias_ih_l0.grad)
        torch.testing.assert_close(own[:, 4:], lstm.weight_hh_l0.grad)
        output = stacked.layers["output"].weight.grad[k]
        torch.testing.assert_close(output, network.output.weight.grad)


def test_each_network_can_be_taken_out_again(networks):
    x = torch.randn(3, 1, 7, 3, generator=torch.Generator().manual_seed(0))
    stacked = StackedNetwork(networks)
    with torch.no_grad():
        expected = stacked(x)
        for network, weights, own, output in zip(
            networks, stacked.arrays(), x, expected, strict=True
        ):
            from_arrays(network, weights)
            np.testing.assert_allclose(network(own), output, atol=1e-6)
