# SPDX-License-Identifier: BSD-3-Clause
"""The torch modules, initialised and run without touching torch's global random state."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

Weights = dict[str, NDArray[np.float32]]


@contextmanager
def single_thread() -> Iterator[None]:
    """Run torch on one thread.

    The matrices are small: more threads gain nothing, slow each other down where several members
    are trained at once, and would make the last digits depend on the machine.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


class _SeededDropout(nn.Module):
    """Dropout that draws from its own generator, so that fits are reproducible in any process."""

    def __init__(self, share: float) -> None:
        super().__init__()
        self.share = share
        self.generator: torch.Generator | None = None

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        if not self.training or self.share == 0:
            return x
        kept = torch.empty_like(x).bernoulli_(1 - self.share, generator=self.generator)
        return x * kept / (1 - self.share)


class LSTMNetwork(nn.Module):
    """One LSTM layer, optionally a fully connected layer with dropout, and a linear output.

    Parameters
    ----------
    n_inputs, n_outputs : int
        Widths.
    hidden_size : int
        Cells of the LSTM.
    dense_size : int
        Width of the fully connected layer; 0 leaves it and the dropout out.
    dropout : float
        Share of its outputs dropped in training.
    window : int
        Rows of history, for which there is no output.
    """

    def __init__(
        self,
        n_inputs: int,
        n_outputs: int,
        hidden_size: int,
        dense_size: int,
        dropout: float,
        window: int,
    ) -> None:
        super().__init__()
        self.window = window
        # made on "meta" nothing is drawn from torch's global generator
        with torch.device("meta"):
            self.lstm = nn.LSTM(n_inputs, hidden_size, batch_first=True)
            self.dense = nn.Linear(hidden_size, dense_size) if dense_size else None
            self.output = nn.Linear(dense_size or hidden_size, n_outputs)
        self.dropout = _SeededDropout(dropout)
        self.to_empty(device="cpu")

    def initialise(self, seed: int, device: torch.device) -> None:
        """Glorot input weights, orthogonal recurrence, forget-gate bias 1, other biases 0."""
        generator = torch.Generator().manual_seed(seed)
        for name, parameter in self.named_parameters():
            if "bias" in name:
                nn.init.zeros_(parameter)
            elif name == "lstm.weight_hh_l0":
                nn.init.orthogonal_(parameter, generator=generator)
            else:
                nn.init.xavier_uniform_(parameter, generator=generator)
        size = self.lstm.hidden_size
        with torch.no_grad():
            self.lstm.get_parameter("bias_ih_l0")[size : 2 * size] = 1.0
        self.dropout.generator = torch.Generator(device).manual_seed(seed)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Outputs of the rows after the history of every window."""
        hidden = self.lstm(x)[0][:, self.window :]
        if self.dense is not None:
            hidden = self.dropout(torch.relu(self.dense(hidden)))
        outputs: torch.Tensor = self.output(hidden)
        return outputs


class Members(nn.ModuleList):
    """Networks of any kind, each with its own inputs, run one after another."""

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Map (n_members, n_windows, n_rows, n_inputs) to outputs, member by member."""
        return torch.stack([network(own) for network, own in zip(self, x, strict=True)])

    def arrays(self) -> list[Weights]:
        """Weights of each network."""
        return [to_arrays(network) for network in self]


def to_arrays(network: nn.Module) -> Weights:
    """Weights as plain arrays, which pickle and skops can store."""
    return {name: tensor.cpu().numpy().copy() for name, tensor in network.state_dict().items()}


def from_arrays(network: nn.Module, weights: Weights) -> None:
    """Put stored weights into a network."""
    network.load_state_dict({name: torch.tensor(array) for name, array in weights.items()})
