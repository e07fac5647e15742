# SPDX-License-Identifier: BSD-3-Clause
"""Base of the recurrent regressors: checks, scaling, resampling, held-out rows, streaming."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.utils import check_random_state
from sklearn.utils.parallel import Parallel, delayed
from sklearn.utils.validation import _check_sample_weight, check_is_fitted
from torch import nn

from skidyn._columns import ColumnSpec
from skidyn._compat import CallbackSupportMixin, Interval, StrOptions, fit_context, fit_progress
from skidyn._keys import Keys, fitted_keys
from skidyn._order import taken, time_order
from skidyn._signals import Array
from skidyn._validation import validate_motion
from skidyn.model_selection import order_of_log
from skidyn.neural_network._engine import (
    Network,
    Plan,
    Task,
    Training,
    make_net,
    networks_of,
    run,
    train,
    weights_of,
)
from skidyn.neural_network._network import LSTMNetwork, Weights
from skidyn.neural_network._parameters import SkorchParameters
from skidyn.neural_network._stream import TorqueStream
from skidyn.preprocessing import scaling_of

#: Number of fits that are trained side by side in one process.
SIDE_BY_SIDE = 10


class SequenceRegressor(
    SkorchParameters, CallbackSupportMixin, MultiOutputMixin, RegressorMixin, BaseEstimator
):
    """Base of the recurrent regressors: one LSTM network, or one for each output."""

    per_joint = False
    _module: ClassVar[type[nn.Module]] = LSTMNetwork

    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {
        "window": [Interval(Integral, 1, None, closed="left")],
        "stride": [Interval(Integral, 1, None, closed="left")],
        "hidden_size": [Interval(Integral, 1, None, closed="left")],
        "dense_size": [Interval(Integral, 0, None, closed="left")],
        "dropout": [Interval(Real, 0, 1, closed="left")],
        "max_epochs": [Interval(Integral, 1, None, closed="left")],
        "learning_rate": [Interval(Real, 0, None, closed="neither")],
        "batch_size": [Interval(Integral, 1, None, closed="left")],
        "optimizer": [callable, None],
        "callbacks": [list, None],
        "validation_fraction": [Interval(Real, 0, 1, closed="neither")],
        "scaling": [StrOptions({"standard", "minmax"})],
        "resample": [StrOptions({"trajectory"}), None],
        "device": [str],
        "verbose": ["verbose"],
        "trajectory": [str, Integral, None],
        "time": [str, Integral, None],
        "random_state": ["random_state"],
    }
    # BaggingRegressor leaves the rows in order and bootstraps through weights only if weights are
    # requested; with metadata routing enabled, these lines request them
    __metadata_request__fit = {"sample_weight": True}
    __metadata_request__score = {"sample_weight": True}

    def __init__(
        self,
        *,
        window: int = 4,
        stride: int = 4,
        hidden_size: int = 32,
        dense_size: int = 0,
        dropout: float = 0.0,
        max_epochs: int = 100,
        learning_rate: float = 0.03,
        batch_size: int = 32,
        optimizer: Any = None,
        callbacks: list[Any] | None = None,
        validation_fraction: float = 0.1,
        scaling: str = "standard",
        resample: str | None = None,
        device: str = "cpu",
        verbose: int = 0,
        trajectory: ColumnSpec = "auto",
        time: ColumnSpec = "auto",
        random_state: Any = None,
        **skorch: Any,
    ) -> None:
        self.window = window
        self.stride = stride
        self.hidden_size = hidden_size
        self.dense_size = dense_size
        self.dropout = dropout
        self.max_epochs = max_epochs
        self.learning_rate = learning_rate
        self.batch_size = batch_size
        self.optimizer = optimizer
        self.callbacks = callbacks
        self.validation_fraction = validation_fraction
        self.scaling = scaling
        self.resample = resample
        self.device = device
        self.verbose = verbose
        self.trajectory = trajectory
        self.time = time
        self.random_state = random_state
        self._set_skorch(skorch)

    def __getstate__(self) -> dict[str, Any]:
        """State with plain arrays of weights in place of the net, for pickle and skops."""
        state = dict(super().__getstate__())
        if "_net" in state:
            state["_weights"] = self.weights_
            del state["_net"]
        return state

    # ---- for subclasses to override ----

    def _inputs(self, X: Array, keys: Keys) -> Array:
        """Inputs of the network, in physical units."""
        return X[:, list(keys.features)]

    def _network(self, n_inputs: int, n_outputs: int, seed: int) -> dict[str, Any]:
        """Constructor arguments of the LSTM network."""
        sizes = {name: getattr(self, name) for name in ("hidden_size", "dense_size", "dropout")}
        given = {k.removeprefix("module__"): v for k, v in self._skorch().items() if "module_" in k}
        unknown = sorted(set(given) - set(sizes))
        if unknown:
            raise ValueError(
                f"the network has no parameter {unknown[0]!r}; module__... may be "
                f"{', '.join(sizes)}"
            )
        fixed = {"n_inputs": n_inputs, "n_outputs": n_outputs, "window": self.window, "seed": seed}
        return fixed | sizes | given

    # ---- fit ----

    @fit_context(prefer_skip_nested_validation=True)
    def fit(self, X: Any, y: Any, sample_weight: Any = None) -> Any:
        """Train the network.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            Features, with key columns; rows of a trajectory in order of time.
        y : array-like of shape (n_samples,) or (n_samples, n_outputs), N m (N if prismatic)
            Torque, or the torque that a physical model leaves unexplained.
        sample_weight : array-like of shape (n_samples,), default=None
            Weight of each row's squared error. Rows of weight zero still serve as history.

        Returns
        -------
        self : object
            The fitted regressor.
        """
        X, y = validate_motion(self, X, y, multi_output=True, y_numeric=True, dtype=np.float64)
        keys = self._keys()
        rng = check_random_state(self.random_state)
        weight = _check_sample_weight(sample_weight, X, dtype=np.float64, copy=True)
        if not (weight > 0).any():
            raise ValueError("all sample weights are zero; at least one must be positive.")
        order = order_of_log(self, X, keys)
        X, y, weight = (taken(table, order) for table in (X, y, weight))
        trajectories = keys.trajectories(X)
        if self.resample == "trajectory":
            weight *= _trajectory_bootstrap(trajectories, weight, rng)
        validation = None
        if self._plan().validates:
            validation = _held_out_rows(trajectories, weight, self.validation_fraction, rng)
        fit = PendingFit(self, X, y, weight, validation, keys, int(rng.randint(2**31 - 1)))
        pending = _PENDING.get()
        if pending is None:
            fit.train()
        else:
            pending.append(fit)
        return self

    def _tasks(self, X: Array, y: Array, weight: Array, keys: Keys, seed: int) -> list[Task]:
        """Networks to be trained (one, or one per output) with their targets."""
        used = weight > 0
        targets = y.reshape(len(y), -1)
        inputs = self._inputs(X, keys)
        self.input_offset_, self.input_scale_ = scaling_of(inputs[used], self.scaling)
        self.output_offset_, self.output_scale_ = scaling_of(targets[used], self.scaling)
        scaled_inputs = ((inputs - self.input_offset_) / self.input_scale_).astype(np.float32)
        scaled_targets = (targets - self.output_offset_) / self.output_scale_
        tasks = []
        every = list(range(targets.shape[1]))
        for k, outputs in enumerate([[j] for j in every] if self.per_joint else [every]):
            own_seed = (seed + k) % 2**31
            made_with = self._network(inputs.shape[1], len(outputs), own_seed)
            own = scaled_targets[:, outputs]
            tasks.append(Task(self._module, made_with, scaled_inputs, own, weight, own_seed))
        return tasks

    def _store(self, training: Training, numbers: Sequence[int]) -> None:
        """Store the results of the networks with these numbers, which are this estimator's."""
        self.__dict__.pop("_net", None)
        self._weights = [training.weights[k] for k in numbers]
        if len(numbers) == len(training.weights):
            self._net = training.net
        self.loss_curve_ = [loss for k in numbers for loss in training.loss_curves[k]]
        self.validation_curve_ = training.validation_curve
        self.n_iter_ = len(self.loss_curve_)

    @property
    def net_(self) -> Any:
        """Initialised skorch net with the fitted weights."""
        check_is_fitted(self)
        if "_net" not in vars(self):
            net = make_net(self._networks(), self._plan(), weights=self._weights)
            self._net = net.initialize()
        return self._net

    @property
    def weights_(self) -> list[Weights]:
        """Weights of the network, or of one network per output."""
        check_is_fitted(self)
        return weights_of(self._net.module_) if "_net" in vars(self) else self._weights

    def _networks(self) -> list[Network]:
        """Class and constructor arguments of each network."""
        return [(self._module, parameters) for parameters in self._made_with]

    def _plan(self) -> Plan:
        settings = {
            "lr": self.learning_rate,
            "max_epochs": self.max_epochs,
            "batch_size": self.batch_size,
            "optimizer": self.optimizer,
            "callbacks": self.callbacks,
            "device": self.device,
            "verbose": self.verbose,
        }
        own = {k: v for k, v in self._skorch().items() if not k.startswith("module__")}
        return Plan(self.window, self.stride, settings | own)

    def _keys(self) -> Keys:
        return fitted_keys(self)

    # ---- predict ----

    def predict(self, X: Any) -> Array:
        """Predict the torque of every row from that row and the earlier rows of its segment.

        Later rows have no influence: predicting a growing log gives the same numbers as predicting
        the whole log at once. Use :meth:`stream` to predict only the new rows.

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
        X = validate_motion(self, X, reset=False, dtype=np.float64)
        order = time_order(X, self._keys())
        if order is None:
            return self._predict_array(X)
        torque: Array = self._predict_array(X[order])[np.argsort(order)]
        return torque

    def _predict_array(self, X: Array) -> Array:
        torque = self._output(X)
        return torque[:, 0] if self._one_dimensional else torque

    def _output(self, X: Array) -> Array:
        """Output of the networks in physical units, (n_samples, n_outputs)."""
        keys = self._keys()
        inputs = (self._inputs(X, keys) - self.input_offset_) / self.input_scale_
        module, segments = self.net_.module_, keys.segments(X)
        parts = [
            run(network, inputs, segments, self.window, self.stride, self.device)
            for network in networks_of(module, self._networks())
        ]
        return np.concatenate(parts, axis=1) * self.output_scale_ + self.output_offset_

    def stream(self) -> TorqueStream:
        """Begin to predict a log that arrives in parts.

        Returns
        -------
        stream : TorqueStream
            Object whose ``predict`` takes new rows and returns their torque.
        """
        check_is_fitted(self)
        return TorqueStream(self)


@dataclass
class PendingFit:
    """A prepared fit: data checked, sample weights drawn, nothing trained yet.

    The weight of a row includes the bootstrap; the loss of ``validation`` rows decides when to
    stop. The seed is that of initial weights, order of windows and dropout.
    """

    estimator: SequenceRegressor
    X: Array
    y: Array
    weight: Array
    validation: NDArray[np.bool_] | None
    keys: Keys
    seed: int

    def leave_out(self, rows: NDArray[np.intp]) -> None:
        """Set the weight of rows to zero, unless no row with weight would be left."""
        weight = self.weight.copy()
        weight[rows] = 0.0
        if (weight > 0).any():
            self.weight = weight

    def unseen(self, trajectories: NDArray[Any]) -> NDArray[np.bool_]:
        """Rows of trajectories of which no row has a weight in the training."""
        _, number = np.unique(trajectories, return_inverse=True)
        unused: NDArray[np.bool_] = np.bincount(number, self.weight) == 0
        return unused[number]

    def tasks(self) -> list[Task]:
        """Scale the data and return the networks to be trained."""
        model = self.estimator
        model._one_dimensional = self.y.ndim == 1
        tasks = model._tasks(self.X, self.y, self.weight, self.keys, self.seed)
        model._made_with = [task.parameters for task in tasks]
        return tasks

    def train(self) -> None:
        """Train this fit alone."""
        model, tasks = self.estimator, self.tasks()
        segments, plan = self.keys.segments(self.X), model._plan()
        with fit_progress(model, model.max_epochs, self.X, self.y) as progress:
            training = train(tasks, self.validation, segments, plan, progress)
        model._store(training, range(len(tasks)))


_PENDING: ContextVar[list[PendingFit] | None] = ContextVar("pending", default=None)


@contextmanager
def deferred_training() -> Iterator[list[PendingFit]]:
    """Collect fits of recurrent regressors in this thread instead of training them.

    With it, scikit-learn's ``BaggingRegressor`` only draws and seeds the members; then
    :func:`train_together` trains them side by side.
    """
    pending: list[PendingFit] = []
    token = _PENDING.set(pending)
    try:
        yield pending
    finally:
        _PENDING.reset(token)


def train_together(pending: list[PendingFit], n_jobs: int | None) -> None:
    """Train collected fits of clones side by side; the result does not depend on `n_jobs`."""
    size = SIDE_BY_SIDE if all(fit.estimator._plan().is_plain for fit in pending) else 1
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
        training = train(together, None, first.keys.segments(first.X), first.estimator._plan())
        numbers = iter(range(len(together)))
        for fit, own in zip(group, tasks, strict=True):
            fit.estimator._store(training, [next(numbers) for _ in own])
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
    """Rows whose loss decides when to stop: whole trajectories, or the end of a single one."""
    labels, number = np.unique(trajectories[weight > 0], return_inverse=True)
    if len(labels) > 1:
        n_held_out = min(max(1, round(fraction * len(labels))), len(labels) - 1)
        return np.isin(trajectories, rng.permutation(labels)[:n_held_out])
    n_rows = len(trajectories)
    last = np.arange(n_rows) >= n_rows - max(1, int(fraction * n_rows))
    if not (weight[~last] > 0).any() or not (weight[last] > 0).any():
        raise ValueError(
            "a callback monitors rows that are held out from the training; X has too few rows "
            f"({n_rows}). Give more trajectories, or leave out such callbacks."
        )
    return last
