# SPDX-License-Identifier: BSD-3-Clause
"""Rigid-body dynamics and kinematics of a robot, batched over samples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn.dynamics import Engine, KinematicTree
from skidyn.robots._assembly import LinkPlacement

#: Inertial parameters of a body, in their order.
PARAMETER_SYMBOLS = ("m", "mcx", "mcy", "mcz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")


class RigidBodyDynamics:
    """Kinematics and dynamics of a robot, from its tree and inertial parameters."""

    name: str
    joint_names: tuple[str, ...]
    body_names: tuple[str, ...]
    gravity: np.ndarray
    inertial_parameters: np.ndarray
    tree: KinematicTree
    links: dict[str, LinkPlacement]

    @property
    def n_joints(self) -> int:
        """Number of independent joints."""
        return len(self.joint_names)

    @property
    def n_bodies(self) -> int:
        """Number of moving bodies."""
        return len(self.body_names)

    @cached_property
    def _engine(self) -> Engine:
        return Engine(self.tree, self.inertial_parameters, self.gravity)

    def inverse_dynamics(
        self,
        q: Any,
        dq: Any,
        ddq: Any,
        *,
        parameters: Any = None,
        gravity: Sequence[float] | None = None,
        dtype: Any = np.float64,
        backend: str = "numpy",
    ) -> np.ndarray:
        """Joint torques of a motion, without friction.

        Parameters
        ----------
        q, dq, ddq : array-like of shape (n_samples, n_joints)
            Positions (rad, m), velocities and accelerations.
        parameters : array-like of shape (n_bodies, 10), default=None
            Inertial parameters in place of those of the URDF.
        gravity : sequence of 3 floats, default=None
            Gravitational acceleration in the base frame in place of the robot's, m/s^2.
        dtype : {numpy.float64, numpy.float32}, default=numpy.float64
            float32 is about twice as fast; its error stays below 2e-6 of the largest torque.
        backend : {"numpy", "once", "compiled"}, default="numpy"
            ``"numpy"`` generates a program for this robot and keeps it. ``"once"`` generates none,
            which is several times as fast for a robot that is evaluated only once on a few thousand
            samples. ``"compiled"`` generates C text for this robot, compiles it once with the
            system's C compiler (about a second) and is then several times as fast. The last two
            work in float64 only.

        Returns
        -------
        ndarray of shape (n_samples, n_joints)
            N m; N for prismatic joints.

        Raises
        ------
        SkidynError
            Signals, parameters or gravity have the wrong shape, or there is no C compiler.

        Examples
        --------
        >>> from skidyn.datasets import load_scara
        >>> load_scara().inverse_dynamics([[0, 0, 0, 0]], [[0, 0, 0, 0]], [[0, 0, 1, 0]]).round(2)
        array([[ 0.  ,  0.  , 16.22,  0.  ]])
        """
        _check_backend(backend, dtype, "once")
        signals = self._signals(q=q, dq=dq, ddq=ddq)
        return self._engine.inverse_dynamics(
            signals,
            _checked_gravity(gravity),
            parameters=self._parameters(parameters),
            dtype=dtype,
            backend=backend,
        )

    def gravity_torque(
        self,
        q: Any,
        *,
        parameters: Any = None,
        gravity: Sequence[float] | None = None,
        backend: str = "numpy",
    ) -> np.ndarray:
        """Joint torques that hold the robot at rest.

        Parameters
        ----------
        q : array-like of shape (n_samples, n_joints)
            Positions, rad or m.
        parameters : array-like of shape (n_bodies, 10), default=None
            Inertial parameters in place of those of the URDF.
        gravity : sequence of 3 floats, default=None
            Gravitational acceleration in the base frame in place of the robot's, m/s^2.
        backend : {"numpy", "once", "compiled"}, default="numpy"
            As of :meth:`inverse_dynamics`.

        Returns
        -------
        ndarray of shape (n_samples, n_joints)
            N m; N for prismatic joints.
        """
        _check_backend(backend, np.float64, "once")
        return self._engine.inverse_dynamics(
            self._signals(q=q),
            _checked_gravity(gravity),
            parameters=self._parameters(parameters),
            backend=backend,
        )

    def inertial_torque(self, q: Any, ddq: Any, *, parameters: Any = None) -> np.ndarray:
        """Joint torques that accelerate the robot from rest, without gravity.

        Parameters
        ----------
        q, ddq : array-like of shape (n_samples, n_joints)
            Positions and accelerations.
        parameters : array-like of shape (n_bodies, 10), default=None
            Inertial parameters in place of those of the URDF.

        Returns
        -------
        ndarray of shape (n_samples, n_joints)
            N m; N for prismatic joints.
        """
        return self._engine.inverse_dynamics(
            self._signals(q=q, ddq=ddq), (0.0, 0.0, 0.0), parameters=self._parameters(parameters)
        )

    def coriolis_torque(self, q: Any, dq: Any, *, parameters: Any = None) -> np.ndarray:
        """Centrifugal and Coriolis torques.

        Parameters
        ----------
        q, dq : array-like of shape (n_samples, n_joints)
            Positions (rad, m) and velocities.
        parameters : array-like of shape (n_bodies, 10), default=None
            Inertial parameters in place of those of the URDF.

        Returns
        -------
        ndarray of shape (n_samples, n_joints)
            N m; N for prismatic joints.
        """
        return self._engine.inverse_dynamics(
            self._signals(q=q, dq=dq), (0.0, 0.0, 0.0), parameters=self._parameters(parameters)
        )

    def mass_matrix(self, q: Any, *, parameters: Any = None) -> np.ndarray:
        """Joint-space inertia matrix.

        Parameters
        ----------
        q : array-like of shape (n_samples, n_joints)
            Positions, rad or m.
        parameters : array-like of shape (n_bodies, 10), default=None
            Inertial parameters in place of those of the URDF.

        Returns
        -------
        ndarray of shape (n_samples, n_joints, n_joints)
            Symmetric; kg m^2, with kg m and kg where prismatic joints take part.
        """
        return self._engine.mass_matrix(self._signals(q=q), self._parameters(parameters))

    def forward_dynamics(self, q: Any, dq: Any, tau: Any, *, parameters: Any = None) -> np.ndarray:
        """Joint accelerations due to torques, without friction.

        Parameters
        ----------
        q, dq : array-like of shape (n_samples, n_joints)
            Positions and velocities.
        tau : array-like of shape (n_samples, n_joints)
            Joint torques, N m or N.
        parameters : array-like of shape (n_bodies, 10), default=None
            Inertial parameters in place of those of the URDF.

        Returns
        -------
        ndarray of shape (n_samples, n_joints)
            rad/s^2 or m/s^2.

        Raises
        ------
        SkidynError
            The inertia matrix is singular: some joint moves no mass.
        """
        tau = self._signals(tau=tau)["tau"]
        bias = self.inverse_dynamics(q, dq, np.zeros_like(tau), parameters=parameters)
        try:
            solved = np.linalg.solve(
                self.mass_matrix(q, parameters=parameters), (tau - bias)[..., np.newaxis]
            )
        except np.linalg.LinAlgError as error:
            raise SkidynError(
                "The mass matrix is singular because a joint moves no mass. Give the links an "
                "<inertial>."
            ) from error
        return solved[..., 0]

    def torque_regressor(
        self,
        q: Any,
        dq: Any,
        ddq: Any,
        *,
        dtype: Any = np.float64,
        out: np.ndarray | None = None,
        backend: str = "numpy",
    ) -> np.ndarray:
        """Joint torque per unit of every inertial parameter.

        ``inverse_dynamics(q, dq, ddq) == torque_regressor(q, dq, ddq) @ parameters.ravel()``.

        Parameters
        ----------
        q, dq, ddq : array-like of shape (n_samples, n_joints)
            Positions (rad, m), velocities and accelerations.
        dtype : {numpy.float64, numpy.float32}, default=numpy.float64
            Precision.
        out : ndarray of shape (n_joints, 10 * n_bodies, n_samples), default=None
            Memory to write into, C-contiguous and of type ``dtype``; saves the time to allocate new
            memory.
        backend : {"numpy", "compiled"}, default="numpy"
            ``"compiled"`` works as in :meth:`inverse_dynamics`; a few seconds to compile.

        Returns
        -------
        ndarray of shape (n_samples, n_joints, 10 * n_bodies)
            In the memory the samples come last: ``moveaxis(result, 0, -1)`` is contiguous.
        """
        signals = self._signals(q=q, dq=dq, ddq=ddq)
        _check_backend(backend, dtype)
        return self._engine.torque_regressor(signals, dtype=dtype, out=out, backend=backend)

    def iter_torque_regressor(
        self,
        q: Any,
        dq: Any,
        ddq: Any,
        chunk: int | None = None,
        *,
        backend: str = "numpy",
        body: int | None = None,
    ) -> Iterator[tuple[slice, np.ndarray]]:
        """Yield the regressor chunk by chunk, without storing all of it.

        Parameters
        ----------
        q, dq, ddq : array-like of shape (n_samples, n_joints)
            Positions (rad, m), velocities and accelerations.
        chunk : int, default=None
            Largest number of samples at a time. None: 3072, or 512 with ``backend="compiled"``.
        backend : {"numpy", "compiled"}, default="numpy"
            ``"compiled"`` works as in :meth:`inverse_dynamics`; a few seconds to compile.
        body : int, optional
            Position in ``body_names`` of the only body whose ten columns are computed, which takes
            a small part of the time; all bodies by default. Not with ``backend="compiled"``.

        Yields
        ------
        rows : slice
            The samples.
        Y : ndarray of shape (n_joints, 10 * n_bodies, rows)
            Their regressor, samples last, or the ten columns of ``body``. The memory is used again
            for the next chunk.

        Raises
        ------
        SkidynError
            If ``chunk`` is below 1, ``body`` is not one of the bodies, or ``backend`` does not
            compute the columns of one.
        """
        if chunk is None:
            chunk = 512 if backend == "compiled" else 3072
        if chunk < 1:
            raise SkidynError(f"chunk is {chunk}; expected at least 1.")
        signals = self._signals(q=q, dq=dq, ddq=ddq)
        _check_backend(backend, np.float64)
        if body is not None:
            if body not in range(self.n_bodies) or backend == "compiled":
                raise SkidynError(
                    f"body is {body} with backend={backend!r}; expected one from 0 to "
                    f'{self.n_bodies - 1} and "numpy".'
                )
            columns = tuple(range(10 * body, 10 * body + 10))
            yield from self._engine.iter_regressor_columns(signals, columns, 0, chunk)
            return
        run = self._engine.iter_compiled if backend == "compiled" else self._engine.iter_chunks
        yield from run(signals, chunk, "torque_regressor", self._engine.gravity_key())

    def forward_kinematics(self, q: Any, body: int | str = -1) -> tuple[np.ndarray, np.ndarray]:
        """Pose of a body or link frame in the base frame.

        Parameters
        ----------
        q : array-like of shape (n_samples, n_joints)
            Positions, rad or m.
        body : int or str, default=-1
            Position in ``body_names``, or the name of any link of the URDF.

        Returns
        -------
        position : ndarray of shape (n_samples, 3)
            m.
        rotation : ndarray of shape (n_samples, 3, 3)
            Columns are the axes of the frame.
        """
        pose = self._engine.evaluate(self._signals(q=q), "pose", *self._frame(body))
        return np.ascontiguousarray(pose[:, :, 3]), np.ascontiguousarray(pose[:, :, :3])

    def jacobian(self, q: Any, body: int | str = -1) -> np.ndarray:
        """Velocity of a body or link frame per unit joint velocity.

        Parameters
        ----------
        q : array-like of shape (n_samples, n_joints)
            Positions, rad or m.
        body : int or str, default=-1
            Position in ``body_names``, or the name of any link of the URDF.

        Returns
        -------
        ndarray of shape (n_samples, 6, n_joints)
            Linear velocity of the frame's origin (rows 0 to 2) and angular velocity (rows 3 to 5),
            along the axes of the base frame.
        """
        return self._engine.evaluate(self._signals(q=q), "jacobian", *self._frame(body))

    def _signals(self, **signals: Any) -> dict[str, np.ndarray]:
        """Signals as float64 arrays of one shape (n_samples, n_joints)."""
        arrays = {}
        n_samples = None
        for name, values in signals.items():
            array = np.asarray(values, dtype=np.float64)
            if array.ndim != 2 or array.shape[1] != self.n_joints:
                raise SkidynError(
                    f"{name} has shape {array.shape}; expected (n_samples, {self.n_joints}), one "
                    f"column for each of {', '.join(self.joint_names[:8])}."
                )
            if n_samples is not None and len(array) != n_samples:
                raise SkidynError(
                    f"{name} has {len(array)} samples, the signals before it {n_samples}."
                )
            n_samples = len(array)
            arrays[name] = array
        return arrays

    def _parameters(self, parameters: Any) -> np.ndarray | None:
        if parameters is None:
            return None
        array = np.asarray(parameters, dtype=np.float64)
        if array.size != 10 * self.n_bodies:
            raise SkidynError(
                f"parameters has shape {array.shape}; expected ({self.n_bodies}, 10): "
                f"{', '.join(PARAMETER_SYMBOLS)} of each of {', '.join(self.body_names[:8])}."
            )
        return array.reshape(self.n_bodies, 10)

    def _frame(self, body: int | str) -> tuple[int, tuple[float, ...] | None]:
        """Body and, for a link that is fixed to it, the link's 3 x 4 pose in the body's frame."""
        if isinstance(body, str):
            if body not in self.links:
                raise SkidynError(f"The robot {self.name!r} has no link {body!r}.")
            link = self.links[body]
            pose = np.column_stack([link.rotation, link.translation])
            return link.body, tuple(pose.ravel().tolist())
        if not -self.n_bodies <= body < self.n_bodies:
            raise SkidynError(f"body is {body}; the robot has {self.n_bodies} moving bodies.")
        return body % self.n_bodies, None


def _checked_gravity(gravity: Any) -> Any:
    """Three finite numbers, or None for the gravity of the robot."""
    if gravity is None:
        return None
    try:
        numbers = np.asarray(gravity, dtype=float)
    except (TypeError, ValueError):
        numbers = np.zeros(0)
    if numbers.shape != (3,) or not np.isfinite(numbers).all():
        raise SkidynError(
            f"gravity is {gravity!r}; expected three finite numbers in m/s^2, such as (0, 0, "
            "-9.81), or None for that of the robot."
        )
    return gravity


def _check_backend(backend: str, dtype: Any, *others: str) -> None:
    known = ("numpy", *others, "compiled")
    if backend not in known:
        names = ", ".join(map(repr, known[:-1]))
        raise SkidynError(f"backend is {backend!r}; expected {names} or 'compiled'.")
    if backend != "numpy" and np.dtype(dtype) != np.float64:
        raise SkidynError(f"backend={backend!r} works in float64 only.")
