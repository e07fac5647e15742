# SPDX-License-Identifier: BSD-3-Clause
"""What all recurrent regressors share: checks, scaling, resampling, held-out rows, streaming."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any, ClassVar

import numpy as np
import torch
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils import check_random_state
from sklearn.utils.parallel import Parallel, delayed
from sklearn.utils.validation import _check_sample_weight, check_is_fitted, validate_data

from skidyn._columns import ColumnSpec
from skidyn._compat import (
    CallbackSupportMixin,
    FitProgress,
    Interval,
    StrOptions,
    fit_context,
    fit_progress,
)
from skidyn._keys import Keys, resolve_keys
from skidyn.neural_network._engine import Task, Training, TrainingPlan, run, train
from skidyn.neural_network._network import LSTMNetwork, from_arrays
from skidyn.neural_network._stream import TorqueStream
from skidyn.preprocessing import scaling_of

Array = NDArray[np.float64]

#: Fits that are trained side by side in one process.
SIDE_BY_SIDE = 10


class SequenceRegressor(CallbackSupportMixin, RegressorMixin, BaseEstimator):
    """Base of the recurrent regressors; subclasses state their parameters."""

    window: int
    stride: int
    hidden_size: int
    max_epochs: int
    learning_rate: float
    weight_decay: float
    betas: tuple[float, float]
    batch_size: int
    scaling: str
    early_stopping: bool
    validation_fraction: float
    n_iter_no_change: int
    resample: str | None
    per_joint: bool
    device: str
    trajectory: ColumnSpec
    time: ColumnSpec
    random_state: Any

    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {
        "window": [Interval(Integral, 1, None, closed="left")],
        "stride": [Interval(Integral, 1, None, closed="left")],
        "hidden_size": [Interval(Integral, 1, None, closed="left")],
        "dense_size": [Interval(Integral, 0, None, closed="left")],
        "dropout": [Interval(Real, 0, 1, closed="left")],
        "max_epochs": [Interval(Integral, 1, None, closed="left")],
        "learning_rate": [Interval(Real, 0, None, closed="neither")],
        "weight_decay": [Interval(Real, 0, None, closed="left")],
        "betas": [tuple],
        "batch_size": [Interval(Integral, 1, None, closed="left")],
        "scaling": [StrOptions({"standard", "minmax"})],
        "early_stopping": ["boolean"],
        "validation_fraction": [Interval(Real, 0, 1, closed="neither")],
        "n_iter_no_change": [Interval(Integral, 1, None, closed="left")],
        "resample": [StrOptions({"trajectory"}), None],
        "per_joint": ["boolean"],
        "device": [str],
        "trajectory": [str, Integral, None],
        "time": [str, Integral, None],
        "random_state": ["random_state"],
    }
    # BaggingRegressor leaves the rows in order and bootstraps through weights only if they are
    # requested; with metadata routing on, this is the request
    __metadata_request__fit = {"sample_weight": True}

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        return tags

    # ---- what subclasses may change ----

    def _inputs(self, X: Array, keys: Keys) -> Array:
        """Inputs of the network, in physical units."""
        return X[:, list(keys.features)]

    def _network(self, n_inputs: int, n_outputs: int) -> LSTMNetwork:
        dense_size, dropout = getattr(self, "dense_size", 0), getattr(self, "dropout", 0.0)
        return LSTMNetwork(n_inputs, n_outputs, self.hidden_size, dense_size, dropout, self.window)

    # ---- fit ----

    @fit_context(prefer_skip_nested_validation=True)
    def fit(self, X: Any, y: Any, sample_weight: Any = None) -> Any:
        """Train the network.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            Features, with key columns; rows of a trajectory in order of time.
        y : array-like of shape (n_samples,) or (n_samples, n_outputs), N m (N if prismatic)
            Torque, or what is left of it.
        sample_weight : array-like of shape (n_samples,), default=None
            Weight of each row's squared error. Rows of weight zero still serve as history.

        Returns
        -------
        self : object
            The fitted regressor.
        """
        X, y = validate_data(self, X, y, multi_output=True, y_numeric=True, dtype=np.float64)
        keys = self._keys()
        rng = check_random_state(self.random_state)
        weight = np.ones(len(X))
        if sample_weight is not None:
            weight = _check_sample_weight(sample_weight, X, dtype=np.float64, copy=True)
        if not (weight > 0).any():
            raise ValueError("all sample weights are zero; at least one must be positive.")
        trajectories = keys.trajectories(X)
        if self.resample == "trajectory":
            weight *= _trajectory_bootstrap(trajectories, weight, rng)
        validation = None
        if self.early_stopping:
            validation = _held_out_rows(trajectories, weight, self.validation_fraction, rng)
        fit = PendingFit(self, X, y, weight, validation, keys, int(rng.randint(2**31 - 1)))
        pending = _PENDING.get()
        if pending is None:
            fit.train()
        else:
            pending.append(fit)
        return self

    def _tasks(self, X: Array, y: Array, weight: Array, keys: Keys, seed: int) -> list[Task]:
        """Networks to be trained, one or one an output, and what they learn."""
        used = weight > 0
        targets = y.reshape(len(y), -1)
        inputs = self._inputs(X, keys)
        self.input_offset_, self.input_scale_ = scaling_of(inputs[used], self.scaling)
        self.output_offset_, self.output_scale_ = scaling_of(targets[used], self.scaling)
        scaled_inputs = ((inputs - self.input_offset_) / self.input_scale_).astype(np.float32)
        scaled_targets = (targets - self.output_offset_) / self.output_scale_
        n_outputs = targets.shape[1]
        groups = [[j] for j in range(n_outputs)] if self.per_joint else [list(range(n_outputs))]
        tasks = []
        for k, outputs in enumerate(groups):
            network = self._network(inputs.shape[1], len(outputs))
            own_seed = (seed + k) % 2**31
            network.initialise(own_seed, torch.device(self.device))
            tasks.append(Task(network, scaled_inputs, scaled_targets[:, outputs], weight, own_seed))
        return tasks

    def _store(self, trainings: list[Training]) -> None:
        """Keep what the networks have become."""
        self.weights_ = [training.weights for training in trainings]
        self.loss_curve_ = [loss for t in trainings for loss in t.loss_curve]
        self.validation_curve_ = [loss for t in trainings for loss in t.validation_curve]
        self.n_iter_ = len(self.loss_curve_)

    def _plan(self) -> TrainingPlan:
        return TrainingPlan(
            window=self.window,
            stride=self.stride,
            max_epochs=self.max_epochs,
            batch_size=self.batch_size,
            learning_rate=self.learning_rate,
            weight_decay=self.weight_decay,
            betas=self.betas,
            patience=self.n_iter_no_change,
            device=self.device,
        )

    def _keys(self) -> Keys:
        names = getattr(self, "feature_names_in_", None)
        return resolve_keys(
            None if names is None else list(names),
            self.n_features_in_,
            trajectory=self.trajectory,
            time=self.time,
        )

    # ---- predict ----

    def predict(self, X: Any) -> Array:
        """Predict the torque of every row from it and the rows before it in its segment.

        Rows that come later change nothing: predicting a growing log gives the same numbers as
        predicting it whole. Use :meth:`stream` to predict only the new rows.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            As in fit.

        Returns
        -------
        y : ndarray of shape (n_samples,) or (n_samples, n_outputs), N m (N if prismatic)
            Predicted torque.
        """
        check_is_fitted(self)
        X = validate_data(self, X, reset=False, dtype=np.float64)
        return self._predict_array(X)

    def _predict_array(self, X: Array) -> Array:
        torque = self._output(X)
        return torque[:, 0] if self._one_dimensional else torque

    def _output(self, X: Array) -> Array:
        """Output of the networks in physical units, (n_samples, n_outputs)."""
        keys = self._keys()
        inputs = (self._inputs(X, keys) - self.input_offset_) / self.input_scale_
        parts = []
        for weights in self.weights_:
            network = self._network(inputs.shape[1], len(weights["output.bias"]))
            from_arrays(network, weights)
            parts.append(
                run(network, inputs, keys.segments(X), self.window, self.stride, self.device)
            )
        return np.concatenate(parts, axis=1) * self.output_scale_ + self.output_offset_

    def stream(self) -> TorqueStream:
        """Begin to predict a log that arrives bit by bit.

        Returns
        -------
        stream : TorqueStream
            Its ``predict`` takes new rows and returns their torque.
        """
        check_is_fitted(self)
        return TorqueStream(self)


@dataclass
class PendingFit:
    """A fit that is prepared: data checked, weights drawn, nothing trained yet.

    Attributes
    ----------
    estimator : SequenceRegressor
        What is fitted.
    X, y, weight : ndarray
        All rows, and the weight of each with the bootstrap in it.
    validation : ndarray of bool or None
        Rows that decide when to stop.
    keys : Keys
        Key columns of X.
    seed : int
        Draws initial weights, order of windows and dropout.
    """

    estimator: SequenceRegressor
    X: Array
    y: Array
    weight: Array
    validation: NDArray[np.bool_] | None
    keys: Keys
    seed: int

    def leave_out(self, rows: NDArray[np.intp]) -> None:
        """Take the weight from rows, unless nothing would be left."""
        weight = self.weight.copy()
        weight[rows] = 0.0
        if (weight > 0).any():
            self.weight = weight

    def unseen(self, trajectories: NDArray[Any]) -> NDArray[np.bool_]:
        """Rows of trajectories of which no row counts in the training."""
        _, number = np.unique(trajectories, return_inverse=True)
        unused: NDArray[np.bool_] = np.bincount(number, self.weight) == 0
        return unused[number]

    def tasks(self) -> list[Task]:
        """Networks to be trained; scales the data."""
        self.estimator._one_dimensional = self.y.ndim == 1
        return self.estimator._tasks(self.X, self.y, self.weight, self.keys, self.seed)

    def train(self) -> None:
        """Train this one alone."""
        model, tasks = self.estimator, self.tasks()
        # networks that stop early do so at different times
        groups = [tasks] if self.validation is None else [[task] for task in tasks]
        segments, trainings = self.keys.segments(self.X), []
        with fit_progress(model, model.max_epochs * len(groups), self.X, self.y) as progress:
            for group in groups:
                trainings += train(group, self.validation, segments, model._plan(), progress)
        model._store(trainings)


_PENDING: ContextVar[list[PendingFit] | None] = ContextVar("pending", default=None)


@contextmanager
def deferred_training() -> Iterator[list[PendingFit]]:
    """Collect fits of recurrent regressors in this thread instead of training them.

    So scikit-learn's ``BaggingRegressor`` draws and seeds the members, and :func:`train_together`
    trains them side by side.
    """
    pending: list[PendingFit] = []
    token = _PENDING.set(pending)
    try:
        yield pending
    finally:
        _PENDING.reset(token)


def train_together(pending: list[PendingFit], n_jobs: int | None) -> None:
    """Train collected fits of clones, several side by side; `n_jobs` changes no bit of them."""
    size = 1 if any(fit.validation is not None for fit in pending) else SIDE_BY_SIDE
    groups = [pending[i : i + size] for i in range(0, len(pending), size)]
    trained = Parallel(n_jobs=n_jobs)(delayed(_train_group)(group) for group in groups)
    for group, models in zip(groups, trained, strict=True):
        for fit, fitted in zip(group, models, strict=True):
            fit.estimator.__dict__.update(fitted.__dict__)


def _train_group(group: list[PendingFit]) -> list[SequenceRegressor]:
    if len(group) == 1:
        group[0].train()
    else:
        first = group[0]
        tasks = [fit.tasks() for fit in group]
        together = [task for own in tasks for task in own]
        segments, quiet = first.keys.segments(first.X), FitProgress(first.estimator, None)
        trainings = iter(train(together, None, segments, first.estimator._plan(), quiet))
        for fit, own in zip(group, tasks, strict=True):
            fit.estimator._store([next(trainings) for _ in own])
    return [fit.estimator for fit in group]


def _trajectory_bootstrap(
    trajectories: NDArray[Any], weight: Array, rng: np.random.RandomState
) -> Array:
    """How often each row's trajectory was drawn; trajectories without weight are not drawn."""
    labels, number = np.unique(trajectories, return_inverse=True)
    alive = np.flatnonzero(np.bincount(number, weight) > 0)
    drawn = np.bincount(rng.choice(alive, size=len(alive)), minlength=len(labels))
    return drawn[number].astype(np.float64)


def _held_out_rows(
    trajectories: NDArray[Any], weight: Array, fraction: float, rng: np.random.RandomState
) -> NDArray[np.bool_]:
    """Rows that decide when to stop: whole trajectories, or the end of the only one."""
    labels, number = np.unique(trajectories[weight > 0], return_inverse=True)
    if len(labels) > 1:
        n_held_out = min(max(1, round(fraction * len(labels))), len(labels) - 1)
        return np.isin(trajectories, rng.permutation(labels)[:n_held_out])
    n_rows = len(trajectories)
    last = np.arange(n_rows) >= n_rows - max(1, int(fraction * n_rows))
    if not (weight[~last] > 0).any() or not (weight[last] > 0).any():
        raise ValueError(
            "early_stopping needs rows for training and rows that are held out; X has too few "
            f"({n_rows}). Give more trajectories, or set early_stopping=False."
        )
    return last
