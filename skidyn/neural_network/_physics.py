# SPDX-License-Identifier: BSD-3-Clause
"""Physics as input of a network: its torque, and the torque per unit of each coefficient."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone

from skidyn._columns import Columns
from skidyn._signals import Array
from skidyn.effects import TermSum
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot


class BareRigidBody:
    """A robot's rigid body with its own inertial parameters."""

    def __init__(self, robot: Robot, columns: Columns) -> None:
        self.robot = robot
        self._columns = columns

    @property
    def inertial_parameters(self) -> Array:
        """Inertial parameters, (n_bodies, 10)."""
        return self.robot.inertial_parameters

    def _state(self, X: Array) -> tuple[Array, Array, Array]:
        columns = self._columns
        assert columns.ddq is not None
        return X[:, list(columns.q)], X[:, list(columns.dq)], X[:, list(columns.ddq)]

    def torque(self, X: Array) -> Array:
        """Torque, (n_samples, n_joints)."""
        return self.robot.inverse_dynamics(*self._state(X))

    def columns(self, X: Array) -> Iterator[tuple[slice, NDArray[Any]]]:
        """Torque per coefficient, (n_joints, n_coefficients, rows), part by part."""
        yield from self.robot.iter_torque_regressor(*self._state(X))


class IdentifiedPhysics:
    """Rigid body with effects, identified by an :class:`~skidyn.identification.RBDRegressor`.

    Effects that depend on the load use the load of the identified model. The model is fitted
    already or by :meth:`fit`.
    """

    def __init__(self, model: RBDRegressor, columns: Columns) -> None:
        self.model = model
        keys = [key for key in (columns.trajectory, columns.time) if key is not None]
        self._order = [*keys, *columns.state()]
        # X is an array here, so its keys are given by position
        self._keys = {
            "trajectory": None if columns.trajectory is None else 0,
            "time": None if columns.time is None else len(keys) - 1,
        }

    def fit(self, X: Array, y: Array) -> RBDRegressor:
        """Identify a copy of the model on rows of X."""
        self.model = clone(self.model).set_params(**self._keys)
        return self.model.fit(X[:, self._order], y)

    @property
    def inertial_parameters(self) -> Array:
        """Inertial parameters, (n_bodies, 10)."""
        return self.model.inertial_parameters_

    def torque(self, X: Array) -> Array:
        """Torque, (n_samples, n_joints)."""
        return np.reshape(self.model.predict(X[:, self._order]), (len(X), -1))

    def columns(self, X: Array) -> Iterator[tuple[slice, NDArray[Any]]]:
        """Torque per coefficient, (n_joints, n_coefficients, rows), part by part."""
        signals, _ = self.model._motion(X[:, self._order])
        motion = signals.q, signals.dq, signals.ddq
        robot, torque = self.model.robot_, self.model.rigid_body_torque(*motion)
        effects = list(self.model._effects(signals.with_(robot=robot), torque))
        places = TermSum(term for term, _ in effects)
        for rows, rigid in robot.iter_torque_regressor(*motion):
            own = np.zeros((len(rigid), places.width, rigid.shape[2]))
            for (_, blocks), (_, place) in zip(effects, places.slices(), strict=True):
                for joint, values in blocks.items():
                    own[joint, place] = values[rows].T
            yield rows, np.concatenate([rigid, own], axis=1)


def robot_of(physics: Any) -> Robot:
    """Robot of a physical model."""
    robot = physics.robot if isinstance(physics, RBDRegressor) else physics
    return robot if isinstance(robot, Robot) else Robot.from_urdf(robot)
