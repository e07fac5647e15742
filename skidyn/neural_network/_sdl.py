# SPDX-License-Identifier: BSD-3-Clause
"""Network that reads the rigid-body torque, learned together with the rigid body (SDL)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import torch
from numpy.typing import NDArray
from sklearn.utils.validation import check_is_fitted, validate_data
from torch import nn

from skidyn._columns import Columns, ColumnSpec, resolve_columns
from skidyn._compat import StrOptions, fit_progress
from skidyn.hybrid._range import TrainingRange, distances, fade
from skidyn.model_selection._split import held_out_folds
from skidyn.neural_network._base import SequenceRegressor
from skidyn.neural_network._engine import run, train
from skidyn.neural_network._network import LSTMNetwork, from_arrays
from skidyn.preprocessing._affine import scaling_of
from skidyn.preprocessing._keys import Keys
from skidyn.robots import Robot

Array = NDArray[np.float64]

#: Directions of the rigid-body parameters that move the torque less than this share of the
#: strongest direction cannot be identified from the log and stay at the robot's own values.
IDENTIFIABLE = 1e-4


class _JointNetwork(nn.Module):
    """Rigid body and LSTM in one graph, so that both are optimised together.

    An input row is ``[features, torque, regressor]``: the scaled features, the scaled torque that
    the robot's own parameters give, and how the torque changes along each identified direction of
    the parameters.
    """

    def __init__(
        self, core: LSTMNetwork, directions: Array, n_features: int, n_joints: int, residual: bool
    ) -> None:
        super().__init__()
        self.core = core
        self.rigid_body = nn.Parameter(torch.tensor(directions, dtype=torch.float32))
        self.n_features = n_features
        self.n_joints = n_joints
        self.residual = residual

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        sizes = [self.n_features, self.n_joints, x.shape[-1] - self.n_features - self.n_joints]
        features, torque, regressor = x.split(sizes, dim=-1)
        regressor = regressor.reshape(*torque.shape, len(self.rigid_body))
        torque = torque + regressor @ self.rigid_body
        output = self.core(torch.cat([features, torque], dim=-1))
        return output + torque[:, x.shape[1] // 2 :] if self.residual else output


class SDLRegressor(SequenceRegressor):
    """Semiparametric deep learning model: an LSTM network that also reads the rigid-body torque.

    The network of :class:`NDLRegressor` with the rigid-body torque among its inputs [1]_. The
    inertial parameters start at their least-squares values and are optimised together with the
    network through the torque regressor, in which they are linear (``rigid_body="joint"``), or
    stay at these values (``"frozen"``). Directions of the parameters that the log does not show
    keep the robot's own values.

    Far from the training samples the network's output fades into the rigid-body torque.

    Parameters
    ----------
    robot : Robot
        Robot whose joints the columns of X describe.
    rigid_body : {"joint", "frozen"}, default="joint"
        Whether the inertial parameters are optimised with the network.
    residual : bool, default=True
        Add the rigid-body torque to the network's output, so that the network learns what is
        missing. False is the paper's architecture, which only reads it.
    window : int, default=32
        Rows per window.
    hidden_size : int, default=32
        Cells of the LSTM.
    dense_size : int, default=32
        Width of the fully connected layer.
    dropout : float, default=0.1
        Share of the fully connected layer's outputs dropped in training.
    max_epochs : int, default=100
        Passes over the log.
    learning_rate : float, default=0.01
        First step size of Adam, which falls to zero along a cosine unless `early_stopping` is on; a
        tenth of it for the inertial parameters.
    batch_size : int, default=16
        Windows per step.
    scaling : {"minmax", "standard"}, default="minmax"
        Scaling of inputs and outputs.
    early_stopping : bool, default=False
        Hold trajectories out, stop when they stop improving, keep the best weights.
    validation_fraction : float, default=0.1
        Share of the trajectories held out.
    n_iter_no_change : int, default=10
        Epochs without improvement before stopping.
    resample : {None, "trajectory"}, default=None
        Draw trajectories with replacement before training.
    device : str, default="cpu"
        Torch device.
    trajectory, time : int, str or None, default="auto"
        Key columns of X.
    random_state : int, RandomState or None, default=None
        Draws initial weights, order of windows, dropout and bootstrap.

    Attributes
    ----------
    inertial_parameters_ : ndarray of shape (n_bodies, 10)
        Rigid-body parameters in the model; see :attr:`skidyn.robots.Robot.inertial_parameters`.
    initial_inertial_parameters_ : ndarray of shape (n_bodies, 10)
        Least-squares values that the optimisation started from.
    weights_ : list of dict of str to ndarray
        Weights of the network.
    loss_curve_, validation_curve_ : list of float
        Mean squared error of the scaled outputs after each epoch.
    n_iter_ : int
        Epochs trained.
    radius_ : float
        Distance from the training samples that counts as outside, in standard deviations per
        feature (root mean square).
    n_features_in_ : int
        Columns of X.
    feature_names_in_ : ndarray of str
        Their names, where X has names.

    See Also
    --------
    skidyn.hybrid.HybridRegressor : Physics of any kind with a learner that may stay silent.

    References
    ----------
    .. [1] "Semiparametric Deep Learning Manipulator Inverse Dynamics Modeling Method for Smart
       City and Industrial Applications", section 2.3.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.neural_network import SDLRegressor
    >>> robot = load_planar_arm()
    >>> X = np.random.default_rng(0).normal(size=(200, 6))
    >>> y = robot.inverse_dynamics(X[:, :2], X[:, 2:4], X[:, 4:])
    >>> model = SDLRegressor(robot, window=4, max_epochs=2, random_state=0).fit(X, y)
    >>> model.inertial_parameters_.shape
    (2, 10)
    """

    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {
        **{k: v for k, v in SequenceRegressor._parameter_constraints.items() if k != "per_joint"},
        "robot": [Robot],
        "rigid_body": [StrOptions({"joint", "frozen"})],
        "residual": ["boolean"],
    }
    per_joint = False  # the rigid body couples the joints

    def __init__(
        self,
        robot: Robot,
        *,
        rigid_body: str = "joint",
        residual: bool = True,
        window: int = 32,
        hidden_size: int = 32,
        dense_size: int = 32,
        dropout: float = 0.1,
        max_epochs: int = 100,
        learning_rate: float = 0.01,
        batch_size: int = 16,
        scaling: str = "minmax",
        early_stopping: bool = False,
        validation_fraction: float = 0.1,
        n_iter_no_change: int = 10,
        resample: str | None = None,
        device: str = "cpu",
        trajectory: ColumnSpec = "auto",
        time: ColumnSpec = "auto",
        random_state: Any = None,
    ) -> None:
        self.robot = robot
        self.rigid_body = rigid_body
        self.residual = residual
        self.window = window
        self.hidden_size = hidden_size
        self.dense_size = dense_size
        self.dropout = dropout
        self.max_epochs = max_epochs
        self.learning_rate = learning_rate
        self.batch_size = batch_size
        self.scaling = scaling
        self.early_stopping = early_stopping
        self.validation_fraction = validation_fraction
        self.n_iter_no_change = n_iter_no_change
        self.resample = resample
        self.device = device
        self.trajectory = trajectory
        self.time = time
        self.random_state = random_state

    # The two hooks that the common tests replace, because their tables are of any width.

    def _resolve(self) -> Columns:
        names = getattr(self, "feature_names_in_", None)
        return resolve_columns(
            None if names is None else list(names),
            self.n_features_in_,
            self.robot.joint_names,
            trajectory=self.trajectory,
            time=self.time,
        )

    def _check_targets(self, y: Array) -> None:
        n_targets, n_joints = y[:1].size, self.robot.n_joints
        if n_targets != n_joints:
            raise ValueError(
                f"y has {n_targets} columns; the robot has {n_joints} joints: "
                f"{', '.join(self.robot.joint_names)}."
            )

    def _keys(self) -> Keys:
        columns = self._resolve()
        return Keys(columns.trajectory, columns.time, tuple(columns.state()))

    def _state(self, X: Array) -> tuple[Array, Array, Array]:
        columns = self._resolve()
        assert columns.ddq is not None
        return X[:, list(columns.q)], X[:, list(columns.dq)], X[:, list(columns.ddq)]

    def _fit_arrays(
        self,
        X: Array,
        y: Array,
        weight: Array,
        validation: NDArray[np.bool_] | None,
        keys: Keys,
        seed: int,
    ) -> None:
        self._check_targets(y)
        self._one_dimensional = y.ndim == 1
        targets, used = y.reshape(len(y), -1), weight > 0
        training_rows = used if validation is None else used & ~validation
        features = self._inputs(X, keys)
        self.input_offset_, self.input_scale_ = scaling_of(features[used], self.scaling)
        self.output_offset_, self.output_scale_ = scaling_of(targets[used], self.scaling)
        directions, start = self._identify(X, targets, training_rows)
        own = self.robot.inertial_parameters
        self.initial_inertial_parameters_ = own + (directions @ start).reshape(own.shape)

        folds = held_out_folds(keys.trajectories(X), 5)
        training_range = TrainingRange(features, folds)
        self.radius_ = training_range.radius
        self._scale, self._reference = training_range.scale, training_range.reference

        joint = self.rigid_body == "joint"
        n_features, n_joints = features.shape[1], targets.shape[1]
        core = self._network(n_features + n_joints, n_joints)
        core.initialise(seed, torch.device(self.device))
        network = _JointNetwork(core, start, n_features, n_joints, self.residual)
        network.rigid_body.requires_grad_(joint)
        with fit_progress(self, self.max_epochs, X, y) as progress:
            training = train(
                network,
                self._joint_inputs(X, features, directions),
                (targets - self.output_offset_) / self.output_scale_,
                weight,
                validation,
                keys.segments(X),
                replace(self._plan(seed), slow_parameters="rigid_body" if joint else ""),
                progress,
            )
        learned = training.weights.pop("rigid_body").astype(np.float64) if joint else start
        self.inertial_parameters_ = own + (directions @ learned).reshape(own.shape)
        self.weights_ = [
            {name.removeprefix("core."): array for name, array in training.weights.items()}
        ]
        self.weights_[0].pop("rigid_body", None)
        self.loss_curve_, self.validation_curve_ = training.loss_curve, training.validation_curve
        self.n_iter_ = len(self.loss_curve_)

    def _identify(self, X: Array, targets: Array, rows: NDArray[np.bool_]) -> tuple[Array, Array]:
        """Directions of the parameters that the log shows, and their least-squares coordinates.

        Moving by 1 along any of them changes the scaled torque by 1 (root mean square), so one
        step size suits all of them.
        """
        q, dq, ddq = (signal[rows] for signal in self._state(X))
        missing = (targets[rows] - self.robot.inverse_dynamics(q, dq, ddq)) / self.output_scale_
        n_parameters = self.robot.inertial_parameters.size
        gram, cross = np.zeros((n_parameters, n_parameters)), np.zeros(n_parameters)
        for part, regressor in self.robot.iter_torque_regressor(q, dq, ddq):
            scaled = regressor / self.output_scale_[:, None, None]
            for joint, block in enumerate(scaled):
                gram += block @ block.T
                cross += block @ missing[part, joint]
        n_torques = missing.size
        values, vectors = np.linalg.eigh(gram / n_torques)
        seen = values > IDENTIFIABLE**2 * values[-1]
        directions = vectors[:, seen] / np.sqrt(values[seen])
        return directions, directions.T @ cross / n_torques

    def _joint_inputs(self, X: Array, features: Array, directions: Array) -> Array:
        """Features, the torque of the robot's own parameters and the reduced regressor, scaled."""
        state = self._state(X)
        n_joints = self.robot.n_joints
        reduced = np.empty((len(X), n_joints, directions.shape[1]), dtype=np.float32)
        for part, regressor in self.robot.iter_torque_regressor(*state):
            scaled = regressor / self.output_scale_[:, None, None]
            reduced[part] = np.einsum("jpc,pd->cjd", scaled, directions, optimize=True)
        torque = (self.robot.inverse_dynamics(*state) - self.output_offset_) / self.output_scale_
        scaled_features = (features - self.input_offset_) / self.input_scale_
        return np.concatenate(
            [scaled_features, torque, reduced.reshape(len(X), -1)], axis=1, dtype=np.float32
        )

    def rigid_body_torque(self, X: Any) -> Array:
        """Torque of the rigid body with the learned inertial parameters.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            As in fit.

        Returns
        -------
        torque : ndarray of shape (n_samples,) or (n_samples, n_joints), N m (N if prismatic)
            What the prediction falls back on far from the training samples.
        """
        check_is_fitted(self)
        torque = self._rigid_body(validate_data(self, X, reset=False, dtype=np.float64))
        return torque[:, 0] if self._one_dimensional else torque

    def outside_range(self, X: Any) -> NDArray[np.bool_]:
        """Which samples lie outside the range of the training samples.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            As in fit.

        Returns
        -------
        outside : ndarray of bool of shape (n_samples,)
            True where the nearest training sample is farther than `radius_`; at twice that
            distance the prediction is the rigid-body torque alone.
        """
        check_is_fitted(self)
        X = validate_data(self, X, reset=False, dtype=np.float64)
        return self._novelty(self._inputs(X, self._keys())) > 1.0

    def _novelty(self, features: Array) -> Array:
        return distances(features, self._scale, self._reference) / self.radius_

    def _rigid_body(self, X: Array) -> Array:
        return self.robot.inverse_dynamics(*self._state(X), parameters=self.inertial_parameters_)

    def _output(self, X: Array) -> Array:
        keys = self._keys()
        features, rigid_body = self._inputs(X, keys), self._rigid_body(X)
        scaled = np.c_[
            (features - self.input_offset_) / self.input_scale_,
            (rigid_body - self.output_offset_) / self.output_scale_,
        ]
        network = self._network(scaled.shape[1], rigid_body.shape[1])
        from_arrays(network, self.weights_[0])
        output = run(network, scaled, keys.segments(X), self.window, self.device)
        if self.residual:
            torque = rigid_body + output * self.output_scale_
        else:
            torque = output * self.output_scale_ + self.output_offset_
        kept = fade(self._novelty(features))[:, None]
        return kept * torque + (1 - kept) * rigid_body
