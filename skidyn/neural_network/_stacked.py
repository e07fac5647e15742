# SPDX-License-Identifier: BSD-3-Clause
"""Networks of one architecture as one computation, for training side by side."""

from __future__ import annotations

from typing import Any

import torch
from torch import nn
from torch.autograd.function import once_differentiable

from skidyn.neural_network._network import LSTMNetwork, Weights


class _StackedLSTM(torch.autograd.Function):
    """LSTM layers of several members with a backward pass written out by hand.

    The cost of a small layer is that of its calls, not of its arithmetic. Here each time step takes
    a few calls for all members: one product of ``[x, 1, h]`` with the weights forward, and two
    backward. Gates are in torch's order: input, forget, cell, output.
    """

    @staticmethod
    def forward(ctx: Any, x: torch.Tensor, weights: torch.Tensor) -> torch.Tensor:
        """Hidden states (n_rows, n_members, n_windows, n_hidden), from zero.

        ``x`` is (n_rows, n_members, n_windows, n_inputs), ``weights`` is
        (n_members, n_inputs + 1 + n_hidden, 4 n_hidden).
        """
        *sizes, n_inputs = x.shape
        size = weights.shape[-1] // 4
        read = x.new_empty(sizes[0] + 1, *sizes[1:], n_inputs + 1 + size)
        read[:-1, ..., :n_inputs] = x
        read[..., n_inputs] = 1
        hidden = read[..., n_inputs + 1 :]
        hidden[0] = 0
        gates = x.new_empty(*sizes, 4 * size)
        candidate, squashed = x.new_empty(2, *sizes, size)
        cell = x.new_zeros(sizes[0] + 1, *sizes[1:], size)
        tables = candidate, squashed, cell[:-1], cell[1:], hidden[1:]
        for row, gate, i, f, g, o, u, tanh, before, after, h in _rows(
            read[:-1], gates, *torch.split(gates, size, -1), *tables
        ):
            torch.bmm(row, weights, out=gate)
            torch.tanh(g, out=u)
            gate.sigmoid_()  # the result for g is not used; one call for all gates is faster
            torch.mul(i, u, out=after).addcmul_(f, before)
            torch.tanh(after, out=tanh)
            torch.mul(o, tanh, out=h)
        ctx.save_for_backward(weights, read, gates, candidate, cell, squashed)
        return hidden[1:]

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *gradients: torch.Tensor) -> tuple[None, torch.Tensor]:
        """Gradient of the weights; that of the inputs is not needed."""
        (outer,) = gradients
        weights, read, gates, candidate, cell, squashed = ctx.saved_tensors
        size = weights.shape[-1] // 4
        hidden = read[..., -size:]
        recurrent = weights[:, -size:].mT.contiguous()
        d_weights = torch.zeros_like(weights)
        d_gates = torch.zeros_like(gates[0])
        d_i, d_f, d_g, d_o = torch.split(d_gates, size, -1)
        d_ifg = torch.unflatten(d_gates[..., : 3 * size], -1, (3, size))
        d_cell = torch.zeros_like(cell[0])
        d_hidden, work = torch.empty_like(d_cell), torch.empty_like(d_cell)
        i, f, _, o = torch.split(gates, size, -1)
        tables = read[:-1].mT, gates, i, f, o, candidate, squashed, cell[:-1], hidden[1:]
        for d_out, row, gate, i, f, o, u, tanh, before, h in reversed(_rows(outer, *tables)):
            torch.baddbmm(d_out, d_gates, recurrent, out=d_hidden)
            torch.addcmul(o, h, tanh, value=-1, out=work)  # o (1 - tanh^2) = o - h tanh
            d_cell.addcmul_(d_hidden, work)
            torch.addcmul(gate, gate, gate, value=-1, out=d_gates)  # s (1 - s)
            d_i.mul_(u)
            d_f.mul_(before)
            d_o.mul_(tanh).mul_(d_hidden)
            torch.mul(i, u, out=work)
            torch.addcmul(i, work, u, value=-1, out=d_g)  # i (1 - u^2)
            d_ifg.mul_(d_cell[:, :, None])
            d_cell.mul_(f)
            d_weights.baddbmm_(row, d_gates)
        return None, d_weights


def _rows(*tables: torch.Tensor) -> list[tuple[torch.Tensor, ...]]:
    """Slices of the tables for each time step; far faster than indexing every table."""
    return list(zip(*(table.unbind() for table in tables), strict=True))


class StackedNetwork(nn.Module):
    """Initialised networks of one architecture, each with its own inputs, as one computation."""

    def __init__(self, networks: list[LSTMNetwork]) -> None:
        super().__init__()
        self.window = networks[0].window
        self.n_inputs = networks[0].lstm.input_size
        states = [network.state_dict() for network in networks]
        lstm = [
            torch.cat(
                [
                    state["lstm.weight_ih_l0"],
                    (state["lstm.bias_ih_l0"] + state["lstm.bias_hh_l0"])[:, None],
                    state["lstm.weight_hh_l0"],
                ],
                dim=1,
            ).T
            for state in states
        ]
        self.lstm = nn.Parameter(torch.stack(lstm))
        self.layers: dict[str, _StackedLinear] = {}
        for name in ("dense", "output"):
            if f"{name}.weight" in states[0]:
                self.layers[name] = _StackedLinear(
                    torch.stack([state[f"{name}.weight"] for state in states]),
                    torch.stack([state[f"{name}.bias"] for state in states]),
                )
                self.add_module(name, self.layers[name])
        self.linear: nn.Parameter | None = None
        if "linear.weight" in states[0]:
            self.linear = nn.Parameter(torch.stack([s["linear.weight"] for s in states]))
        self.dropouts = nn.ModuleList([network.dropout for network in networks])

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Map (n_members, n_windows, n_rows, n_inputs) to outputs, member by member."""
        read = x.permute(2, 0, 1, 3)
        hidden = _StackedLSTM.apply(read, self.lstm)[self.window :]  # type: ignore[no-untyped-call]
        n_targets, n_members, n_windows, size = hidden.shape
        # (n_members, n_targets * n_windows, n_hidden)
        hidden = hidden.transpose(0, 1).reshape(n_members, -1, size)
        if "dense" in self.layers:
            hidden = torch.tanh(self.layers["dense"](hidden))
            if self.training:
                dropped = zip(self.dropouts, hidden, strict=True)
                hidden = torch.stack([dropout(own) for dropout, own in dropped])
        output: torch.Tensor = self.layers["output"](hidden)
        output = output.reshape(n_members, n_targets, n_windows, -1).transpose(1, 2)
        if self.linear is None:
            return output
        own = x[:, :, self.window :].flatten(1, 2)
        return output + torch.bmm(own, self.linear.mT).reshape(output.shape)

    def arrays(self) -> list[Weights]:
        """Weights of each network, named as in :class:`LSTMNetwork`."""
        n, members = self.n_inputs, []
        for k, lstm in enumerate(self.lstm.detach().mT):
            weights = {
                "lstm.weight_ih_l0": lstm[:, :n],
                "lstm.weight_hh_l0": lstm[:, n + 1 :],
                "lstm.bias_ih_l0": lstm[:, n],
                "lstm.bias_hh_l0": torch.zeros_like(lstm[:, n]),
            }
            for name, layer in self.layers.items():
                weights[f"{name}.weight"] = layer.weight[k].detach()
                weights[f"{name}.bias"] = layer.bias[k].detach()
            if self.linear is not None:
                weights["linear.weight"] = self.linear[k].detach()
            members.append({name: tensor.cpu().numpy().copy() for name, tensor in weights.items()})
        return members


class _StackedLinear(nn.Module):
    """Linear layers of several members: weights (n_members, n_outputs, n_inputs) and biases."""

    def __init__(self, weight: torch.Tensor, bias: torch.Tensor) -> None:
        super().__init__()
        self.weight, self.bias = nn.Parameter(weight), nn.Parameter(bias)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return torch.baddbmm(self.bias[:, None], x, self.weight.mT)
