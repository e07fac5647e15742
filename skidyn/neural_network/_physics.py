# SPDX-License-Identifier: BSD-3-Clause
"""Physics that a network reads: its torque, and how the torque changes with each coefficient."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone

from skidyn._columns import Columns
from skidyn.evidence._kinematics import smooth_motion
from skidyn.evidence._problem import term_columns
from skidyn.rigid_body import RBDRegressor
from skidyn.rigid_body._rbd_regressor import _DRY
from skidyn.robots import Robot

Array = NDArray[np.float64]


class BareRigidBody:
    """A robot's rigid body with its own inertial parameters.

    Parameters
    ----------
    robot : Robot
        The robot.
    columns : Columns
        Which column of X means what.
    """

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
    """Rigid body with effects, as an :class:`~skidyn.rigid_body.RBDRegressor` has identified them.

    Effects that see a load see that of the identified model.

    Parameters
    ----------
    model : RBDRegressor
        Not fitted, or fitted by :meth:`fit`.
    columns : Columns
        Which column of X means what.
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
        signals = self.model._read(X[:, self._order])
        if self.model._smooths():
            signals = smooth_motion(signals).signals
        blocks = effect_columns(self.model, signals)
        widths = [next(iter(block.values())).shape[1] for block in blocks]
        motion = signals.q, signals.dq, signals.ddq
        for rows, rigid in self.model.robot_.iter_torque_regressor(*motion):
            own = np.zeros((len(rigid), sum(widths), rigid.shape[2]))
            for block, end, width in zip(blocks, np.cumsum(widths), widths, strict=True):
                for joint, values in block.items():
                    own[joint, end - width : end] = values[rows].T
            yield rows, np.concatenate([rigid, own], axis=1)


def effect_columns(model: RBDRegressor, signals: Any) -> list[dict[int, Array]]:
    """Columns of a fitted model's effects, each seeing the torque of those before it."""
    torque = model.rigid_body_torque(signals.q, signals.dq, signals.ddq)
    load, smooth, blocks = torque.copy(), torque.copy(), []
    signals = signals.with_(robot=model.robot_)
    for term in model._in_order():  # as RBDRegressor.predict does
        seen = signals.with_(
            load=load,
            model_torque=torque.copy(),
            smooth_torque=smooth.copy(),
            inertial_parameters=model.inertial_parameters_,
        )
        blocks.append(term_columns(seen, term))
        for joint, block in blocks[-1].items():
            part = block @ model.effect_coefficients_[term]
            torque[:, joint] += part
            if term.kind not in _DRY:
                smooth[:, joint] += part
    return blocks


def robot_of(physics: Robot | RBDRegressor) -> Robot:
    """Robot of a physical model."""
    robot = physics if isinstance(physics, Robot) else physics.robot
    return robot if isinstance(robot, Robot) else Robot.from_urdf(robot)
