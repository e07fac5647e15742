# SPDX-License-Identifier: BSD-3-Clause
"""Network with the rigid-body torque as input, trained together with the rigid body (SDL)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from numbers import Integral
from os import PathLike
from typing import Any, ClassVar

import numpy as np
import torch
from numpy.typing import NDArray
from sklearn.base import clone
from sklearn.model_selection import check_cv
from sklearn.utils import _safe_indexing
from sklearn.utils.validation import check_is_fitted
from skorch.callbacks import Checkpoint, TrainEndCheckpoint
from torch import nn

from skidyn._columns import Columns, column_names, resolve_columns
from skidyn._compat import HasMethods, Interval, StrOptions
from skidyn._keys import Keys
from skidyn._order import folds_taken, taken, time_order
from skidyn._signals import Array
from skidyn._text import counted
from skidyn._validation import motion_of, validate_motion
from skidyn.hybrid import TrainingRange, distances, fade, learned_weights
from skidyn.identification import RBDRegressor
from skidyn.model_selection import held_out_folds
from skidyn.neural_network._base import SequenceRegressor
from skidyn.neural_network._engine import Plan, Task, Training, run
from skidyn.neural_network._network import LSTMNetwork
from skidyn.neural_network._physics import BareRigidBody, IdentifiedPhysics, robot_of
from skidyn.preprocessing import scaling_of
from skidyn.robots import Robot

#: Directions of the rigid-body parameters that change the torque by less than this fraction of the
#: strongest direction cannot be identified from the log and stay at the robot's own values.
IDENTIFIABLE = 1e-4


class _JointNetwork(nn.Module):
    """Rigid body and LSTM in one graph, to be optimised together.

    An input row is ``[features, torque, regressor]``: the scaled features, the scaled torque that
    the robot's own parameters give, and how the torque changes along each identified direction of
    the parameters.
    """

    def __init__(
        self, start: Array, n_features: int, residual: bool, trainable: bool, **core: Any
    ) -> None:
        super().__init__()
        self.core = LSTMNetwork(**core)
        rigid_body = torch.tensor(start, dtype=torch.float32)
        self.rigid_body = nn.Parameter(rigid_body, requires_grad=trainable)
        self.n_features = n_features
        self.n_joints = core["n_outputs"]
        self.residual = residual

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        sizes = [self.n_features, self.n_joints, x.shape[-1] - self.n_features - self.n_joints]
        features, torque, regressor = torch.split(x, sizes, dim=-1)
        regressor = regressor.reshape(*torque.shape, len(self.rigid_body))
        torque = torque + regressor @ self.rigid_body
        output: torch.Tensor = self.core(torch.cat([features, torque], dim=-1))
        return output + torque[:, self.core.window :] if self.residual else output


def _writes(callback: Any) -> bool:
    """Whether a callback writes files; such callbacks are not given to the held-out copies."""
    own = callback[1] if isinstance(callback, tuple) else callback
    return isinstance(own, Checkpoint | TrainEndCheckpoint)


class SDLRegressor(SequenceRegressor):
    """Semiparametric deep learning model: an LSTM network with a physical torque as further input.

    The network of :class:`NDLRegressor` with the torque of a physical model among its inputs [1]_.
    The model's coefficients (inertial parameters, and effects such as friction) start at their
    least-squares values and are optimised together with the network through the columns in which
    the torque is linear (``rigid_body="joint"``), or stay at these values (``"frozen"``).
    Directions of the coefficients that the log does not excite keep the model's own values.

    Far from the training samples the prediction fades into the physical torque. The torque that the
    optimisation adds to the physics is weighted for each joint by its benefit on held-out
    trajectories, so that the model is not worse than its physics (see `cv`). A robot alone has no
    friction: with an RBDRegressor with effects, the model predicts far better on all logs of
    :doc:`/user_guide/learners`.

    Parameters
    ----------
    physics : Robot, RBDRegressor, str or path
        Source of the physical torque: the rigid body of a robot (or of its URDF), as in the paper,
        or a rigid body with effects, which is identified first. The columns of X must describe the
        joints of this robot.
    rigid_body : {"joint", "frozen"}, default="joint"
        Whether the coefficients are optimised with the network.
    residual : bool, default=True
        Add the physical torque to the network's output, so that the network learns only the
        residual. False is the paper's architecture, in which this torque is only an input
        (:ref:`papers_own_forms` lists all differences).
    cv : int, cross-validator, iterable of splits or None, default=3
        Folds on which copies of the model are tested to find ``learned_weight_``; a number splits
        by trajectory, or a single trajectory by blocks. None trains once and keeps the full output
        of the network, as does ``residual=False``.
    fade_out : bool, default=True
        Fade the prediction into the physical torque far from the training samples.
    dense_size : int, default=32
        Width of the fully connected layer.
    dropout : float, default=0.1
        Share of the fully connected layer's outputs dropped in training.
    {PARAMETERS}

    Attributes
    ----------
    physics_ : Robot or RBDRegressor
        The given physics, identified if it has effects.
    learned_weight_ : ndarray of shape (n_joints,)
        Factor of the torque that the optimisation adds to the physics: the least-squares factor on
        held-out trajectories minus one standard error, between 0 and 1.
    coef_ : ndarray of shape (n_coefficients,)
        Values that the optimisation added to the coefficients of ``physics_``: first the inertial
        parameters of every body, then the effects.
    initial_coef_ : ndarray of shape (n_coefficients,)
        Least-squares values from which the optimisation started.
    inertial_parameters_ : ndarray of shape (n_bodies, 10)
        Rigid-body parameters in the model; see :attr:`skidyn.robots.Robot.inertial_parameters`.
    initial_inertial_parameters_ : ndarray of shape (n_bodies, 10)
        Least-squares values from which the optimisation started.
    radius_ : float
        Distance from the training samples that counts as outside, in standard deviations per
        feature (root mean square).
    {ATTRIBUTES}

    See Also
    --------
    skidyn.hybrid.HybridRegressor : Physics of any kind with a learner that may have zero weight.

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
        **SequenceRegressor._parameter_constraints,
        "cv": [
            Interval(Integral, 2, None, closed="left"),
            HasMethods(["split"]),
            Iterable,
            None,
        ],
        "physics": [Robot, RBDRegressor, str, PathLike],
        "rigid_body": [StrOptions({"joint", "frozen"})],
        "residual": ["boolean"],
        "fade_out": ["boolean"],
    }

    _module = _JointNetwork
    __metadata_request__fit = {"sample_weight": True, "groups": True}
    __metadata_request__score = {"sample_weight": True}

    def __init__(
        self,
        physics: Robot | RBDRegressor | str | PathLike[str],
        *,
        rigid_body: str = "joint",
        residual: bool = True,
        cv: Any = 3,
        fade_out: bool = True,
        dense_size: int = 32,
        dropout: float = 0.1,
        **parameters: Any,
    ) -> None:
        super().__init__(dense_size=dense_size, dropout=dropout, **parameters)
        self.physics = physics
        self.rigid_body = rigid_body
        self.residual = residual
        self.cv = cv
        self.fade_out = fade_out

    def fit(self, X: Any, y: Any, sample_weight: Any = None, groups: Any = None) -> SDLRegressor:
        """Train the network and the physics, and find the weight of the learned torque.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            Features, with key columns; rows of a trajectory in order of time.
        y : array-like of shape (n_samples,) or (n_samples, n_joints), N m (N if prismatic)
            Torque.
        sample_weight : array-like of shape (n_samples,), default=None
            Weight of each row's squared error. Rows of weight zero still serve as history.
        groups : array-like of shape (n_samples,), default=None
            Groups of the rows for a `cv` that splits by groups, such as ``GroupKFold``.

        Returns
        -------
        self : object
            The fitted regressor.
        """
        self.__dict__.pop("learned_weight_", None)
        super().fit(X, y, sample_weight)
        if self.residual and self.cv is not None and hasattr(self, "loss_curve_"):
            self.learned_weight_ = self._held_out_weight(X, y, sample_weight, groups)
        return self

    def _held_out_weight(self, X: Any, y: Any, sample_weight: Any, groups: Any) -> Array:
        """Weight of the learned torque, from copies of the model that have not seen a fold."""
        array = validate_motion(self, X, reset=False, dtype=np.float64)
        table = array if column_names(X) is None else motion_of(self, X)
        target = np.asarray(y, dtype=np.float64)
        counts = np.ones(len(array)) if sample_weight is None else np.asarray(sample_weight)
        folds: Any = None
        if not isinstance(self.cv, Integral):
            folds = list(check_cv(self.cv).split(table, target, groups))
        order = time_order(array, self._keys())
        if order is not None:
            folds = folds_taken(folds, order)
            array, table, target, counts = (taken(t, order) for t in (array, table, target, counts))
        torque = target.reshape(len(array), -1)
        trajectories = self._keys().trajectories(array)
        folds = folds or held_out_folds(trajectories, int(self.cv), guard=8)
        residual, learned = np.zeros(torque.shape), np.zeros(torque.shape)
        unit = np.zeros(len(array), dtype=int)
        for k, (train, test) in enumerate(folds):
            unit[test] = k
            train = train[counts[train] > 0]
            if not len(train):
                continue
            callbacks = [c for c in self.callbacks or () if not _writes(c)] or None
            copy = clone(self).set_params(cv=None, callbacks=callbacks, verbose=0)
            copy.fit(_safe_indexing(table, train), target[train], counts[train])
            part = array[test]
            physics = copy._physics_torque(part)
            residual[test] = torque[test] - physics
            learned[test] = copy._output(part) - physics
        if len(np.unique(trajectories)) > 2:
            unit = np.unique(trajectories, return_inverse=True)[1]
        root = np.sqrt(counts)[:, None]
        weight, _, _ = learned_weights(root * residual, root * learned, unit, 1.0)
        return weight

    def _physics_torque(self, X: Array) -> Array:
        """Torque of the physics alone, with its identified or least-squares coefficients."""
        physics = self._read(self.physics_)
        torque = physics.torque(X)
        if isinstance(physics, BareRigidBody):
            for part, columns in physics.columns(X):
                torque[part] += np.einsum("jpc,p->cj", columns, self.initial_coef_, optimize=True)
        return torque

    # Two hooks that the common tests of scikit-learn replace, because their tables have any width.

    @property
    def _robot(self) -> Robot:
        return robot_of(self.physics)

    def _resolve(self) -> Columns:
        names = getattr(self, "feature_names_in_", None)
        return resolve_columns(
            None if names is None else list(names),
            self.n_features_in_,
            self._robot.joint_names,
            trajectory=self.trajectory,
            time=self.time,
        )

    def _check_targets(self, y: Array) -> None:
        n_targets, n_joints = y[:1].size, self._robot.n_joints
        if n_targets != n_joints:
            raise ValueError(
                f"y has {n_targets} columns; the robot has {counted(n_joints, 'joint')}: "
                f"{', '.join(self._robot.joint_names)}."
            )

    def _keys(self) -> Keys:
        columns = self._resolve()
        return Keys(columns.trajectory, columns.time, tuple(columns.state()))

    def _read(self, physics: Any) -> BareRigidBody | IdentifiedPhysics:
        if not isinstance(physics, RBDRegressor):
            return BareRigidBody(self._robot, self._resolve())
        return IdentifiedPhysics(physics, self._resolve())

    def _tasks(self, X: Array, y: Array, weight: Array, keys: Keys, seed: int) -> list[Task]:
        self._check_targets(y)
        targets, used = y.reshape(len(y), -1), weight > 0
        features = self._inputs(X, keys)
        self.input_offset_, self.input_scale_ = scaling_of(features[used], self.scaling)
        self.output_offset_, self.output_scale_ = scaling_of(targets[used], self.scaling)
        physics = self._read(self.physics)
        self.physics_ = self.physics
        if isinstance(physics, IdentifiedPhysics):
            self.physics_ = physics.fit(X[used], targets[used])
        torque = physics.torque(X)
        self._directions, self._start = self._identify(physics, X, targets - torque, used)

        folds = held_out_folds(keys.trajectories(X), 5)
        training_range = TrainingRange(features, folds)
        self.radius_ = training_range.radius
        self._scale, self._reference = training_range.scale, training_range.reference

        n_features, n_joints = features.shape[1], targets.shape[1]
        made_with = self._network(n_features + n_joints, n_joints, seed) | {
            "start": self._start,
            "n_features": n_features,
            "residual": self.residual,
            "trainable": self.rigid_body == "joint",
        }
        inputs = self._joint_inputs(physics, X, features, torque)
        scaled_targets = (targets - self.output_offset_) / self.output_scale_
        return [Task(self._module, made_with, inputs, scaled_targets, weight, seed)]

    def _plan(self) -> Plan:
        return replace(super()._plan(), slow_parameters="rigid_body")

    def _store(self, training: Training, numbers: Sequence[int]) -> None:
        super()._store(training, numbers)
        learned = self.weights_[0]["rigid_body"].astype(np.float64)
        if self.rigid_body == "frozen":
            learned = self._start  # in double precision
        self.initial_coef_ = self._directions @ self._start
        self.coef_ = self._directions @ learned
        del self._directions, self._start
        own = self._read(self.physics_).inertial_parameters
        self.inertial_parameters_, self.initial_inertial_parameters_ = (
            own + change[: own.size].reshape(own.shape)
            for change in (self.coef_, self.initial_coef_)
        )

    def _identify(
        self, physics: Any, X: Array, missing: Array, rows: NDArray[np.bool_]
    ) -> tuple[Array, Array]:
        """Directions of the coefficients that the log excites, and their least-squares coordinates.

        A step of 1 along any direction changes the scaled torque by 1 (root mean square), so one
        step size suits all of them.
        """
        missing = missing / self.output_scale_
        gram: Any = 0.0
        cross: Any = 0.0
        for part, columns in physics.columns(X):
            for joint, block in enumerate(columns / self.output_scale_[:, None, None]):
                own = block[:, rows[part]]
                gram = gram + own @ own.T
                cross = cross + own @ missing[part, joint][rows[part]]
        n_torques = missing[rows].size
        values, vectors = np.linalg.eigh(gram / n_torques)
        seen = values > IDENTIFIABLE**2 * values[-1]
        directions = vectors[:, seen] / np.sqrt(values[seen])
        return directions, directions.T @ cross / n_torques

    def _joint_inputs(
        self, physics: Any, X: Array, features: Array, torque: Array
    ) -> NDArray[np.float32]:
        """Features, the torque of the given physics and the reduced columns, scaled."""
        n_joints = torque.shape[1]
        reduced = np.empty((len(X), n_joints, self._directions.shape[1]), dtype=np.float32)
        for part, columns in physics.columns(X):
            scaled = columns / self.output_scale_[:, None, None]
            reduced[part] = np.einsum("jpc,pd->cjd", scaled, self._directions, optimize=True)
        scaled_torque = (torque - self.output_offset_) / self.output_scale_
        scaled_features = (features - self.input_offset_) / self.input_scale_
        return np.concatenate(
            [scaled_features, scaled_torque, reduced.reshape(len(X), -1)], axis=1, dtype=np.float32
        )

    def rigid_body_torque(self, X: Any) -> Array:
        """Torque of the physics, to which the prediction fades far from the training samples.

        Its coefficients include ``coef_``, weighted by ``learned_weight_``. With ``residual=False``
        the learned coefficients only serve the network and need not give a physical torque; then
        the least-squares values ``initial_coef_`` are used.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            As in fit.

        Returns
        -------
        torque : ndarray of shape (n_samples,) or (n_samples, n_joints), N m (N if prismatic)
            Prediction far from the training samples.
        """
        check_is_fitted(self)
        X = validate_motion(self, X, reset=False, dtype=np.float64)
        torque = self._weighted(X, self._rigid_body(X)[1])
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
        X = validate_motion(self, X, reset=False, dtype=np.float64)
        return self._novelty(self._inputs(X, self._keys())) > 1.0

    def _novelty(self, features: Array) -> Array:
        return distances(features, self._scale, self._reference) / self.radius_

    def _rigid_body(self, X: Array) -> tuple[Array, Array]:
        """Torque that is an input of the network, and torque to which the prediction fades."""
        physics = self._read(self.physics_)
        last_resort = [] if self.residual else [self.initial_coef_]
        coefficients = np.stack([self.coef_, *last_resort])
        torque = np.stack([physics.torque(X)] * len(coefficients))
        for part, columns in physics.columns(X):
            torque[:, part] += np.einsum("jpc,kp->kcj", columns, coefficients, optimize=True)
        return torque[0], torque[-1]

    def _output(self, X: Array) -> Array:
        keys = self._keys()
        features, (rigid_body, last_resort) = self._inputs(X, keys), self._rigid_body(X)
        scaled = np.c_[
            (features - self.input_offset_) / self.input_scale_,
            (rigid_body - self.output_offset_) / self.output_scale_,
        ]
        network = self.net_.module_.core
        output = run(network, scaled, keys.segments(X), self.window, self.stride, self.device)
        if self.residual:
            torque = rigid_body + output * self.output_scale_
        else:
            torque = output * self.output_scale_ + self.output_offset_
        if not self.fade_out:
            return self._weighted(X, torque)
        kept = fade(self._novelty(features))[:, None]
        return self._weighted(X, kept * torque + (1 - kept) * last_resort)

    def _weighted(self, X: Array, torque: Array) -> Array:
        """Torque beyond the physics, weighted as held-out trajectories support it."""
        if not hasattr(self, "learned_weight_"):
            return torque
        physics = self._physics_torque(X)
        weighted: Array = physics + self.learned_weight_ * (torque - physics)
        return weighted
