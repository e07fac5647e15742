# SPDX-License-Identifier: BSD-3-Clause
"""Training and running of sequence networks; skorch does the training inside."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from skorch import NeuralNet
from skorch.callbacks import Callback, EarlyStopping, GradientNormClipping, LRScheduler
from skorch.helper import predefined_split
from torch import nn

from skidyn._compat import FitProgress
from skidyn.neural_network._network import Weights, single_thread, to_arrays
from skidyn.neural_network._windows import WindowLoader, WindowSet, window_rows, window_starts

Array = NDArray[np.float64]

#: Rows that go through the network at once in prediction; more would only need memory.
ROWS_AT_ONCE = 65536


@dataclass(frozen=True)
class TrainingPlan:
    """How a network is trained.

    Attributes
    ----------
    window, max_epochs, batch_size : int
        Rows per window, passes over the log, windows per step.
    learning_rate : float
        Step size of Adam.
    patience : int
        Epochs without improvement on the validation rows after which training ends.
    seed : int
        Draws initial weights, order of windows and dropout.
    device : str
        Where the network is trained.
    slow_parameters : str
        Name of a parameter that moves at a tenth of the learning rate; empty for none.
    """

    window: int
    max_epochs: int
    batch_size: int
    learning_rate: float
    patience: int
    seed: int
    device: str
    slow_parameters: str = ""


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
    """Mean squared error in which each target row has a weight (last column of the targets)."""

    def get_loss(self, y_pred: Any, y_true: Any, X: Any = None, training: bool = False) -> Any:
        weight = y_true[..., -1:]
        squares = weight * (y_pred - y_true[..., :-1]) ** 2
        return squares.sum() / (weight.sum().clamp_min(1e-12) * y_pred.shape[-1])


class _Progress(Callback):
    """Hands skorch's epochs on to scikit-learn's callbacks; refuses a diverged fit."""

    def __init__(self, progress: FitProgress) -> None:
        self.progress = progress

    def on_epoch_begin(self, net: NeuralNet, **kwargs: Any) -> None:
        self.progress.begin_step()

    def on_epoch_end(self, net: NeuralNet, **kwargs: Any) -> None:
        loss = net.history[-1, "train_loss"]
        if not np.isfinite(loss):
            raise ValueError(
                f"training diverged in epoch {len(net.history)} (loss {loss}); lower learning_rate."
            )
        if self.progress.end_step():
            raise KeyboardInterrupt  # skorch's way to end a fit cleanly


def train(
    network: nn.Module,
    inputs: Array,
    targets: Array,
    weight: Array,
    validation: NDArray[np.bool_] | None,
    segments: list[slice],
    plan: TrainingPlan,
    progress: FitProgress,
) -> Training:
    """Train a network on a log.

    Parameters
    ----------
    network : Module
        Initialised; maps (n_windows, 2 window, n_inputs) to (n_windows, window, n_outputs).
    inputs, targets : ndarray of shape (n_samples, n_inputs) and (n_samples, n_outputs)
        Scaled.
    weight : ndarray of shape (n_samples,)
        Weight of each row's error; rows of weight zero still serve as history.
    validation : ndarray of bool of shape (n_samples,) or None
        Rows that only judge; training ends when they stop improving.
    segments : list of slice
        Rows that belong together.
    plan : TrainingPlan
        Settings.
    progress : FitProgress
        Told about every epoch.

    Returns
    -------
    Training
    """
    device = torch.device(plan.device)
    table = torch.as_tensor(inputs, dtype=torch.float32, device=device)

    def window_set(row_weight: Array) -> WindowSet:
        weighted = np.c_[targets, row_weight]
        tensor = torch.as_tensor(weighted, dtype=torch.float32, device=device)
        return WindowSet(table, tensor, segments, plan.window)

    callbacks: list[Any] = [GradientNormClipping(1.0), _Progress(progress)]
    split = None
    if validation is None:
        # steps that shrink to nothing average the noise of small batches away
        cosine = torch.optim.lr_scheduler.CosineAnnealingLR
        callbacks.append(LRScheduler(cosine, T_max=plan.max_epochs))
    else:
        callbacks.insert(1, EarlyStopping(patience=plan.patience, load_best=True, sink=_silent))
        split = predefined_split(window_set(np.where(validation, weight, 0.0)))
        weight = np.where(validation, 0.0, weight)
    slow = [(plan.slow_parameters, {"lr": 0.1 * plan.learning_rate})]
    net = _WeightedNet(
        network,
        criterion=nn.MSELoss,
        optimizer=torch.optim.Adam,
        optimizer__param_groups=slow if plan.slow_parameters else [],
        lr=plan.learning_rate,
        max_epochs=plan.max_epochs,
        batch_size=plan.batch_size,
        train_split=split,
        iterator_train=WindowLoader,
        iterator_train__generator=np.random.default_rng(plan.seed),
        iterator_valid=WindowLoader,
        callbacks=callbacks,
        device=plan.device,
        verbose=0,
    )
    with single_thread():
        net.fit(window_set(weight), None)
    history = net.history
    return Training(
        to_arrays(net.module_),
        history[:, "train_loss"],
        history[:, "valid_loss"] if validation is not None else [],
    )


def _silent(*args: Any, **kwargs: Any) -> None:
    """Swallow skorch's messages."""


def run(
    network: nn.Module, inputs: Array, segments: list[slice], window: int, device: str
) -> Array:
    """Outputs of a network for every row of a log.

    Every segment is cut at multiples of ``window`` rows from its start, so the output of a row
    depends on rows before it alone and does not change when the log grows.

    Parameters
    ----------
    network : Module
        With its weights.
    inputs : ndarray of shape (n_samples, n_inputs)
        Scaled.
    segments : list of slice
        Rows that belong together.
    window : int
        As in training.
    device : str
        Where to run it.

    Returns
    -------
    ndarray of shape (n_samples, n_outputs)
    """
    table = torch.as_tensor(inputs, dtype=torch.float32, device=device)
    rows, valid = window_rows(window_starts(segments, window), window)
    network = network.to(device).eval()
    step = max(1, ROWS_AT_ONCE // (2 * window))
    parts = []
    with single_thread(), torch.inference_mode():
        for i in range(0, len(rows), step):
            out = network(table[torch.as_tensor(rows[i : i + step], device=device)])
            parts.append(out[torch.as_tensor(valid[i : i + step], device=device)].cpu().numpy())
    return np.concatenate(parts).astype(np.float64)
