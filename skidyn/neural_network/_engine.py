# SPDX-License-Identifier: BSD-3-Clause
"""Training and running of sequence networks; skorch does the training inside."""

from __future__ import annotations

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
from skidyn.neural_network._network import LSTMNetwork, Members, Weights, single_thread
from skidyn.neural_network._stacked import StackedNetwork
from skidyn.neural_network._windows import WindowLoader, WindowSet, window_rows, window_starts

Array = NDArray[np.float64]

#: Rows that go through the network at once in prediction; more would only need memory.
ROWS_AT_ONCE = 65536


@dataclass(frozen=True)
class TrainingPlan:
    """How networks are trained.

    Attributes
    ----------
    window, stride, max_epochs, batch_size : int
        Rows of history and targets per window, passes over the log, windows per step.
    learning_rate : float
        First step size of Adam.
    weight_decay : float
        Share of the learning rate by which every step shrinks the weights.
    betas : tuple of float
        How long Adam remembers gradients and their squares.
    patience : int
        Epochs without improvement on the validation rows after which training ends.
    device : str
        Where the networks are trained.
    slow_parameters : str
        Name of a parameter that moves at a tenth of the learning rate and does not shrink; empty
        for none.
    """

    window: int
    stride: int
    max_epochs: int
    batch_size: int
    learning_rate: float
    weight_decay: float
    betas: tuple[float, float]
    patience: int
    device: str
    slow_parameters: str = ""


@dataclass(frozen=True)
class Task:
    """One network and what it is to learn.

    Attributes
    ----------
    network : Module
        Initialised; maps (n_windows, window + stride, n_inputs) to (n_windows, stride, n_outputs).
    inputs, targets : ndarray of shape (n_samples, n_inputs) and (n_samples, n_outputs)
        Scaled.
    weight : ndarray of shape (n_samples,)
        Weight of each row's error; rows of weight zero still serve as history.
    seed : int
        Draws the order of windows.
    """

    network: nn.Module
    inputs: NDArray[Any]
    targets: NDArray[Any]
    weight: Array
    seed: int


@dataclass(frozen=True)
class Training:
    """Result of a training.

    Attributes
    ----------
    weights : dict of str to ndarray
        Weights of the network.
    loss_curve, validation_curve : list of float
        Mean squared error of scaled targets after each epoch; the second is empty without
        validation rows.
    """

    weights: Weights
    loss_curve: list[float]
    validation_curve: list[float]


class _WeightedNet(NeuralNet):
    """Mean squared error in which each target row has a weight (last column of the targets).

    The members' errors are added up, so each member's gradient is that of its own error.
    """

    def train_step(self, batch: Any, **fit_params: Any) -> dict[str, Any]:
        """One step, without the detours by which skorch serves any optimiser and data."""
        inputs, targets = batch
        self.optimizer_.zero_grad()
        loss = self.get_loss(self.module_(inputs), targets, training=True)
        loss.backward()
        self.optimizer_.step()
        return {"loss": loss.detach()}

    def get_loss(self, y_pred: Any, y_true: Any, X: Any = None, training: bool = False) -> Any:
        weight = y_true[..., -1:]
        squares = (weight * (y_pred - y_true[..., :-1]) ** 2).sum(dim=(1, 2, 3))
        losses = squares / (weight.sum(dim=(1, 2, 3)).clamp_min(1e-12) * y_pred.shape[-1])
        if training:
            self.batch_losses_.append(losses.detach())
        return losses.sum()


class _Progress(Callback):
    """Hands skorch's epochs on to scikit-learn's callbacks; refuses a diverged fit."""

    def __init__(self, progress: FitProgress) -> None:
        self.progress = progress
        self.loss_curves: list[NDArray[Any]] = []

    def on_epoch_begin(self, net: NeuralNet, **kwargs: Any) -> None:
        net.batch_losses_ = []
        net.module_.train()
        self.progress.begin_step()

    def on_epoch_end(self, net: NeuralNet, **kwargs: Any) -> None:
        losses = torch.stack(net.batch_losses_).mean(dim=0).cpu().numpy()
        if not np.isfinite(losses).all():
            raise ValueError(
                f"training diverged in epoch {len(net.history)} (loss {losses.max()}); "
                "lower learning_rate."
            )
        self.loss_curves.append(losses.astype(np.float64))
        if self.progress.end_step():
            raise KeyboardInterrupt  # skorch's way to end a fit cleanly


def train(
    tasks: list[Task],
    validation: NDArray[np.bool_] | None,
    segments: list[slice],
    plan: TrainingPlan,
    progress: FitProgress,
) -> list[Training]:
    """Train networks of one architecture side by side on one log.

    Most of a small network's step is overhead (gathering, optimiser, bookkeeping), which all
    networks share here.

    Parameters
    ----------
    tasks : list of Task
        Networks and what they learn.
    validation : ndarray of bool of shape (n_samples,) or None
        Rows that only judge; training ends when they stop improving. For a single task.
    segments : list of slice
        Rows that belong together.
    plan : TrainingPlan
        Settings.
    progress : FitProgress
        Told about every epoch.

    Returns
    -------
    list of Training
    """
    device = torch.device(plan.device)

    def table(parts: list[NDArray[Any]]) -> torch.Tensor:
        return torch.as_tensor(np.stack(parts, dtype=np.float32), device=device)

    inputs = table([task.inputs for task in tasks])

    def window_set(row_weights: list[Array]) -> WindowSet:
        own = zip(tasks, row_weights, strict=True)
        targets = table([np.c_[task.targets, weight] for task, weight in own])
        return WindowSet(inputs, targets, segments, plan.window, plan.stride)

    follow = _Progress(progress)
    callbacks: list[Any] = [follow]
    split, weights = None, [task.weight for task in tasks]
    if validation is None:
        # steps that shrink to nothing average the noise of small batches away
        cosine = torch.optim.lr_scheduler.CosineAnnealingLR
        callbacks.append(LRScheduler(cosine, T_max=plan.max_epochs))
    else:
        callbacks.append(EarlyStopping(patience=plan.patience, load_best=True, sink=_silent))
        split = predefined_split(window_set([np.where(validation, w, 0.0) for w in weights]))
        weights = [np.where(validation, 0.0, w) for w in weights]
    slow = [(f"*.{plan.slow_parameters}", {"lr": 0.1 * plan.learning_rate, "weight_decay": 0.0})]
    net = _WeightedNet(
        _side_by_side([task.network for task in tasks]),
        criterion=nn.MSELoss,
        optimizer=torch.optim.AdamW,
        optimizer__weight_decay=plan.weight_decay,
        optimizer__betas=plan.betas,
        optimizer__param_groups=slow if plan.slow_parameters else [],
        optimizer__fused=True,
        lr=plan.learning_rate,
        max_epochs=plan.max_epochs,
        batch_size=plan.batch_size,
        train_split=split,
        iterator_train=WindowLoader,
        iterator_train__generators=[np.random.default_rng(task.seed) for task in tasks],
        iterator_valid=WindowLoader,
        callbacks=callbacks,
        device=plan.device,
        verbose=0,
    )
    with single_thread():
        net.fit(window_set(weights), None)
    curves = np.array(follow.loss_curves).T.tolist()
    judged = net.history[:, "valid_loss"] if validation is not None else []
    return [
        Training(weights_of, curve, judged)
        for weights_of, curve in zip(net.module_.arrays(), curves, strict=True)
    ]


def _side_by_side(networks: list[nn.Module]) -> nn.Module:
    """One module of many; torch's own LSTM kernel is the fastest for a single network."""
    plain = [network for network in networks if isinstance(network, LSTMNetwork)]
    stacked = 1 < len(networks) == len(plain)
    return StackedNetwork(plain) if stacked else Members(networks)


def _silent(*args: Any, **kwargs: Any) -> None:
    """Swallow skorch's messages."""


def run(
    network: nn.Module,
    inputs: Array,
    segments: list[slice],
    window: int,
    stride: int,
    device: str,
) -> Array:
    """Outputs of a network for every row of a log.

    Every segment is cut at multiples of ``stride`` rows from its start, so the output of a row
    depends on rows before it alone and does not change when the log grows.

    Parameters
    ----------
    network : Module
        With its weights.
    inputs : ndarray of shape (n_samples, n_inputs)
        Scaled.
    segments : list of slice
        Rows that belong together.
    window, stride : int
        As in training.
    device : str
        Where to run it.

    Returns
    -------
    ndarray of shape (n_samples, n_outputs)
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
