# SPDX-License-Identifier: BSD-3-Clause
"""The torch modules, initialised and run without use of torch's global random state."""

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

    The matrices are small: more threads bring no gain, slow each other down when several members
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

    def __init__(self, share: float, seed: int) -> None:
        super().__init__()
        self.share = share
        self.seed = seed
        self._generator: torch.Generator | None = None

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        if not self.training or self.share == 0:
            return x
        if self._generator is None or self._generator.device != x.device:
            self._generator = torch.Generator(x.device).manual_seed(self.seed)
        kept = torch.empty_like(x).bernoulli_(1 - self.share, generator=self._generator)
        return x * kept / (1 - self.share)


class LSTMNetwork(nn.Module):
    """One LSTM layer, optionally a fully connected layer with dropout, and a linear output.

    Initial values: Glorot's for input weights, orthogonal matrices for the recurrence, 1 for the
    bias of the forget gate, 0 for other biases and for the path around the LSTM (``linear``), from
    the inputs of a row to its outputs. There is no output for the ``window`` rows of history.
    """

    def __init__(
        self,
        n_inputs: int,
        n_outputs: int,
        window: int,
        hidden_size: int = 32,
        dense_size: int = 0,
        dropout: float = 0.0,
        linear: bool = False,
        seed: int = 0,
    ) -> None:
        super().__init__()
        self.window = window
        # on device "meta" nothing is drawn from torch's global generator
        with torch.device("meta"):
            self.lstm = nn.LSTM(n_inputs, hidden_size, batch_first=True)
            self.dense = nn.Linear(hidden_size, dense_size) if dense_size else None
            self.output = nn.Linear(dense_size or hidden_size, n_outputs)
            self.linear = nn.Linear(n_inputs, n_outputs, bias=False) if linear else None
        self.dropout = _SeededDropout(dropout, seed)
        self.to_empty(device="cpu")
        generator = torch.Generator().manual_seed(seed)
        for name, parameter in self.named_parameters():
            if "bias" in name or name == "linear.weight":
                nn.init.zeros_(parameter)
            elif name == "lstm.weight_hh_l0":
                nn.init.orthogonal_(parameter, generator=generator)
            else:
                nn.init.xavier_uniform_(parameter, generator=generator)
        # torch's LSTM adds two biases; if both were learned, a gate would change twice as fast
        self.lstm.get_parameter("bias_hh_l0").requires_grad_(False)
        with torch.no_grad():
            self.lstm.get_parameter("bias_ih_l0")[hidden_size : 2 * hidden_size] = 1.0

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Outputs of the rows after the history of every window."""
        # cuDNN would multiply with 10 of the 23 bits of float32, and give other torques than a CPU
        library = torch.backends.cudnn
        with library.flags(enabled=library.enabled, allow_tf32=False):
            hidden = self.lstm(x)[0][:, self.window :]
        if self.dense is not None:
            hidden = self.dropout(torch.tanh(self.dense(hidden)))
        outputs: torch.Tensor = self.output(hidden)
        return outputs if self.linear is None else outputs + self.linear(x[:, self.window :])


class Members(nn.ModuleList):
    """Networks of any kind, each with its own inputs, which run one after another."""

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
