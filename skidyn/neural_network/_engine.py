# SPDX-License-Identifier: BSD-3-Clause
"""Training (by skorch) and prediction of sequence networks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from skorch import NeuralNet
from skorch.callbacks import Callback, EarlyStopping, LRScheduler
from skorch.helper import predefined_split
from torch import nn

from skidyn._compat import FitProgress
from skidyn._signals import Array
from skidyn.neural_network._network import (
    LSTMNetwork,
    Members,
    Weights,
    from_arrays,
    single_thread,
    to_arrays,
)
from skidyn.neural_network._stacked import StackedNetwork
from skidyn.neural_network._windows import WindowLoader, WindowSet, window_rows, window_starts

#: Rows per call of the network in prediction; more rows would only need more memory.
ROWS_AT_ONCE = 65536

#: Class of a network and its constructor arguments.
Network = tuple[type[nn.Module], dict[str, Any]]


@dataclass(frozen=True)
class Plan:
    """How networks are trained: ``window`` rows of history and ``stride`` targets per window.

    ``settings`` are parameters of skorch's net; ``slow_parameters`` is the name of a parameter that
    is trained with a tenth of the learning rate and without weight decay, empty for none.
    """

    window: int
    stride: int
    settings: dict[str, Any]
    slow_parameters: str = ""
    weight_decay: float = 0.05

    @property
    def callbacks(self) -> list[Any]:
        """Callbacks of the user, without the names that skorch accepts with them."""
        given = self.settings["callbacks"] or []
        return [entry[1] if isinstance(entry, tuple) else entry for entry in given]

    @property
    def is_plain(self) -> bool:
        """Whether no setting depends on single networks, so that many can be trained as one."""
        plain = self.settings["optimizer"] is None and not self.settings["callbacks"]
        return plain and not self.settings["verbose"]

    @property
    def validates(self) -> bool:
        """Whether a callback monitors the loss on held-out rows."""
        watched = (getattr(callback, "monitor", None) for callback in self.callbacks)
        return any(callable(name) or str(name).startswith("valid") for name in watched)

    @property
    def schedules(self) -> bool:
        """Whether a callback ends the training early or sets its rate."""
        return any(_is_a(c, EarlyStopping) or _is_a(c, LRScheduler) for c in self.callbacks)


def _is_a(callback: Any, kind: type) -> bool:
    return issubclass(callback if isinstance(callback, type) else type(callback), kind)


@dataclass(frozen=True)
class Task:
    """One network and its training data.

    ``module`` maps (n_windows, window + stride, n_inputs) to (n_windows, stride, n_outputs). Inputs
    and targets are scaled; rows of ``weight`` zero still serve as history. ``seed`` is that of the
    order of windows.
    """

    module: type[nn.Module]
    parameters: dict[str, Any]
    inputs: NDArray[Any]
    targets: NDArray[Any]
    weight: Array
    seed: int


@dataclass(frozen=True)
class Training:
    """Trained net, which holds all networks, and the weights of each.

    Curves are the mean squared error of scaled targets after each epoch: of each network in
    training, and on the validation rows (empty without them).
    """

    net: NeuralNet
    weights: list[Weights]
    loss_curves: list[list[float]]
    validation_curve: list[float]


class SequenceNet(NeuralNet):
    """Mean squared error in which each target row has a weight (last column of the targets).

    The errors of networks that are trained together are added, so the gradient of each network is
    that of its own error.
    """

    def get_loss(self, y_pred: Any, y_true: Any, X: Any = None, training: bool = False) -> Any:
        weight = y_true[..., -1:]
        squares = (weight * (y_pred - y_true[..., :-1]) ** 2).sum(dim=(-3, -2, -1))
        losses = squares / (weight.sum(dim=(-3, -2, -1)).clamp_min(1e-12) * y_pred.shape[-1])
        if training:
            self.batch_losses_.append(losses.detach().reshape(-1))
        return losses.sum()


class _PlainNet(SequenceNet):
    """The same without the overhead of skorch's support for any optimiser, data and callback."""

    def train_step(self, batch: Any, **fit_params: Any) -> dict[str, Any]:
        inputs, targets = batch
        self.optimizer_.zero_grad()
        loss = self.get_loss(self.module_(inputs), targets, training=True)
        loss.backward()
        self.optimizer_.step()
        return {"loss": loss.detach()}


class _Progress(Callback):
    """Report skorch's epochs to scikit-learn's callbacks; raise an error if a fit diverges."""

    def __init__(self, progress: FitProgress | None = None) -> None:
        self.progress = progress
        self.loss_curves: list[NDArray[Any]] = []
        self.validation_curve: list[float] = []

    def on_epoch_begin(self, net: NeuralNet, **kwargs: Any) -> None:
        net.batch_losses_ = []
        net.module_.train()
        if self.progress is not None:
            self.progress.begin_step()

    def on_epoch_end(self, net: NeuralNet, **kwargs: Any) -> None:
        losses = torch.stack(net.batch_losses_).mean(dim=0).cpu().numpy()
        if not np.isfinite(losses).all():
            raise ValueError(
                f"training diverged in epoch {len(net.history)} (loss {losses.max()}); "
                "lower learning_rate."
            )
        self.loss_curves.append(losses.astype(np.float64))
        if net.train_split is not None:
            self.validation_curve.append(net.history[-1, "valid_loss"])
        if self.progress is not None and self.progress.end_step():
            raise KeyboardInterrupt  # skorch's way to end a fit cleanly


def make_net(
    networks: Sequence[Network],
    plan: Plan,
    callbacks: Sequence[Any] = (),
    weights: Sequence[Weights] | None = None,
    **more: Any,
) -> NeuralNet:
    """Make a skorch net, not initialised, for networks that are trained side by side.

    Most of the time of a small network's step is overhead (gathering, optimiser, bookkeeping),
    which all networks share. All have one architecture; weights are drawn at random if they are
    None. Given callbacks come before those of the plan; ``more`` are parameters of the net.
    """
    settings = plan.settings.copy()
    if settings["optimizer"] is None:
        tuned = {"weight_decay": plan.weight_decay, "betas": (0.8, 0.95), "fused": True}
        named = {f"optimizer__{name}": value for name, value in tuned.items()}
        settings = named | settings | {"optimizer": torch.optim.AdamW}
    if plan.slow_parameters:
        slow = {"lr": 0.1 * settings["lr"], "weight_decay": 0.0}
        settings["optimizer__param_groups"] = [(f"*{plan.slow_parameters}", slow)]
    settings["callbacks"] = [*callbacks, *(settings["callbacks"] or [])]
    own: dict[str, Any] = {}
    if len(networks) == 1 and weights is None:
        module: Any = networks[0][0]
        own = {f"module__{name}": value for name, value in networks[0][1].items()}
    elif len(networks) == 1:
        module = made(networks, weights)[0]
    else:
        module = _side_by_side(made(networks, weights))
    kind = _PlainNet if plan.is_plain else SequenceNet
    return kind(module, criterion=nn.MSELoss, **own, **settings, **more)


def made(networks: Sequence[Network], weights: Sequence[Weights] | None = None) -> list[nn.Module]:
    """Networks with given or new weights."""
    modules = [kind(**parameters) for kind, parameters in networks]
    for module, own in zip(modules, weights or (), strict=weights is not None):
        from_arrays(module, own)
    return modules


def train(
    tasks: list[Task],
    validation: NDArray[np.bool_] | None,
    segments: list[slice],
    plan: Plan,
    progress: FitProgress | None = None,
) -> Training:
    """Train networks of one architecture side by side on one log.

    ``validation`` marks rows for validation only, ``segments`` are rows that belong together, and
    ``progress`` receives every epoch.
    """
    device = torch.device(plan.settings["device"])

    def table(parts: list[NDArray[Any]]) -> torch.Tensor:
        return torch.as_tensor(np.stack(parts, dtype=np.float32), device=device)

    inputs = table([task.inputs for task in tasks])

    def window_set(row_weights: list[Array]) -> WindowSet:
        own = zip(tasks, row_weights, strict=True)
        targets = table([np.c_[task.targets, weight] for task, weight in own])
        return WindowSet(inputs, targets, segments, plan.window, plan.stride)

    follow = _Progress(progress)
    callbacks: list[Any] = [("progress", follow)]
    split, weights = None, [task.weight for task in tasks]
    if not plan.schedules:
        # steps that decrease to zero average out the noise of small batches
        cosine = torch.optim.lr_scheduler.CosineAnnealingLR
        callbacks.append(("cosine", LRScheduler(cosine, T_max=plan.settings["max_epochs"])))
    if validation is not None:
        split = predefined_split(window_set([np.where(validation, w, 0.0) for w in weights]))
        weights = [np.where(validation, 0.0, w) for w in weights]
    net = make_net(
        [(task.module, task.parameters) for task in tasks],
        plan,
        callbacks,
        train_split=split,
        iterator_train=WindowLoader,
        iterator_train__generators=[np.random.default_rng(task.seed) for task in tasks],
        iterator_valid=WindowLoader,
    )
    with single_thread():
        net.fit(window_set(weights), None)
    net.set_params(train_split=None)  # it holds a copy of the log
    follow.progress = None
    curves = np.array(follow.loss_curves).T.tolist()
    return Training(net, weights_of(net.module_), curves, follow.validation_curve)


def weights_of(module: nn.Module) -> list[Weights]:
    """Weights of each network of a module."""
    if isinstance(module, StackedNetwork | Members):
        return module.arrays()
    return [to_arrays(module)]


def networks_of(module: nn.Module, networks: Sequence[Network]) -> list[nn.Module]:
    """Networks of a module, each to be run alone."""
    together = isinstance(module, StackedNetwork | Members)
    return made(networks, weights_of(module)) if together else [module]


def _side_by_side(networks: list[nn.Module]) -> nn.Module:
    """One module of several; torch's own LSTM kernel is the fastest for a single network."""
    plain = [network for network in networks if isinstance(network, LSTMNetwork)]
    return StackedNetwork(plain) if len(plain) == len(networks) else Members(networks)


def run(
    network: nn.Module,
    inputs: Array,
    segments: list[slice],
    window: int,
    stride: int,
    device: str,
) -> Array:
    """Outputs of a network for every row of a log, from scaled inputs.

    Every segment is cut at multiples of ``stride`` rows from its start, so the output of a row
    depends only on that row and earlier rows, and does not change when the log grows.
    """
    table = torch.as_tensor(inputs, dtype=torch.float32, device=device)
    rows, valid = window_rows(window_starts(segments, stride), window, stride)
    network = network.to(device).eval()
    step = max(1, ROWS_AT_ONCE // (window + stride))
    parts = []
    with single_thread(), torch.inference_mode():
        for i in range(0, len(rows), step):
            out = network(table[torch.as_tensor(rows[i : i + step], device=device)])
            parts.append(out[torch.as_tensor(valid[i : i + step], device=device)].cpu().numpy())
    return np.concatenate(parts).astype(np.float64)
