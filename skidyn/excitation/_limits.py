# SPDX-License-Identifier: BSD-3-Clause
"""Limits of a motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn._signals import Array
from skidyn.robots import Robot

#: Permitted positions of the last body in the base frame: a box, or a function that returns the
#: clearance in m of positions (m).
Workspace = Callable[[Array], Any] | Sequence[Sequence[float]]


@dataclass(frozen=True)
class MotionLimits:
    """Limits of a motion.

    Parameters
    ----------
    position : array of shape (n_joints, 2), rad or m, optional
        Lowest and highest position; by default those of the URDF, or +-pi where it has none.
    velocity : array of shape (n_joints,), rad/s or m/s, optional
        Largest velocity; by default that of the URDF, or 2 where it has none.
    acceleration : array of shape (n_joints,), rad/s^2 or m/s^2, optional
        Largest acceleration; by default four times the largest velocity per second.
    torque : array of shape (n_joints,), N m or N, optional
        Largest torque of the model: with friction if a fitted model is given, else of the rigid
        bodies of the description. By default that of the URDF.
    workspace : box of shape (3, 2) in m, or callable, optional
        Permitted positions of the origin of the last body in the base frame: a box, or a function
        of positions of shape (n_samples, 3) that returns the clearance of each in m, negative where
        it is forbidden.

    Examples
    --------
    >>> MotionLimits(velocity=[1.0, 1.0]).velocity
    [1.0, 1.0]
    """

    position: Any = None
    velocity: Any = None
    acceleration: Any = None
    torque: Any = None
    workspace: Workspace | None = None

    def resolved(self, robot: Robot) -> MotionLimits:
        """Complete the limits: every limit as an array, from the URDF where none is given.

        Parameters
        ----------
        robot : Robot
            Robot.

        Returns
        -------
        MotionLimits
            Limits with arrays in place of None, except for the workspace.

        Raises
        ------
        SkidynError
            A limit has the wrong shape or permits no motion.
        """
        n = robot.n_joints
        free = np.isfinite(robot.position_limits)
        fallback = np.tile([-np.pi, np.pi], (n, 1))
        position = np.where(free, robot.position_limits, fallback)
        velocity = np.where(np.isfinite(robot.velocity_limits), robot.velocity_limits, 2.0)
        velocity = np.where(velocity > 0, velocity, 2.0)
        effort = np.where(robot.effort_limits > 0, robot.effort_limits, np.inf)
        values = {
            "position": _array("position", self.position, position, (n, 2)),
            "velocity": _array("velocity", self.velocity, velocity, (n,)),
            "torque": _array("torque", self.torque, effort, (n,)),
        }
        values["acceleration"] = _array(
            "acceleration", self.acceleration, 4.0 * values["velocity"], (n,)
        )
        room = values["position"][:, 1] - values["position"][:, 0]
        for name in ("velocity", "acceleration", "torque"):
            room = np.minimum(room, values[name])
        if not np.all(room > 0):
            joint = int(np.argmin(room > 0))
            shown = ", ".join(f"{k} {v[joint].tolist()}" for k, v in values.items())
            raise SkidynError(
                f"the limits of joint {joint + 1} ({robot.joint_names[joint]}) leave no room: "
                f"{shown}"
            )
        if self.workspace is not None and not callable(self.workspace):
            box = _array("workspace", self.workspace, np.zeros(0), (3, 2))
            if np.any(box[:, 0] >= box[:, 1]):
                raise SkidynError(f"the workspace leaves no room: {box.tolist()}")
        return MotionLimits(workspace=self.workspace, **values)

    def clearance(self, position: Array) -> Array:
        """Distance of positions from the bounds of the workspace, negative outside.

        Parameters
        ----------
        position : ndarray of shape (n_samples, 3), m
            Origin of the last body in the base frame.

        Returns
        -------
        ndarray of shape (n_samples,), m
            Infinite if no workspace is given.

        Raises
        ------
        SkidynError
            The workspace function does not return one clearance for each position.
        """
        if self.workspace is None:
            return np.full(len(position), np.inf)
        if not callable(self.workspace):
            low, high = np.asarray(self.workspace, dtype=float).T
            return np.asarray(np.minimum(position - low, high - position).min(axis=1))
        values = np.asarray(self.workspace(position))
        if values.dtype == bool or values.shape != (len(position),):
            raise SkidynError(
                f"the workspace function returned {values.dtype} of shape {values.shape}; expected "
                f"the clearance of each position in m, shape ({len(position)},), negative where it "
                "is forbidden"
            )
        return values.astype(float)


def _array(name: str, given: Any, default: Array, shape: tuple[int, ...]) -> Array:
    value = default if given is None else np.asarray(given, dtype=float)
    if value.shape != shape:
        raise SkidynError(f"the {name} limits have shape {value.shape}; {shape} is expected")
    if np.any(np.isnan(value)):
        raise SkidynError(f"the {name} limits hold NaN")
    return value
