# SPDX-License-Identifier: BSD-3-Clause
"""The simulated robot: its true parameters, its motion, and its torques without effects."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.datasets.hidden_effects._motion import Motion
from skidyn.dynamics import inertial_parts, inertial_vector

if TYPE_CHECKING:
    from skidyn.robots import Robot

#: Travel (rad, m) over which dry friction changes its sign: less than the resolution of an encoder,
#: so it acts as a sign that a joint at rest keeps.
SLIP = 1e-6
#: A joint whose spread of torque is less than this share of the largest one counts as unloaded.
LOADED_SHARE = 0.05


@dataclass
class World:
    """A robot in motion, with its true parameters.

    Signals have the shape (n_trajectories, n_samples, n_joints) on the clock of the log. ``motion``
    is that of the links; ``fine`` is that of the motors (joint side of the gear) on the finer clock
    of the integration, with ``stride`` steps of ``step`` s per sample. ``time`` in s continues over
    the session; temperatures are in degrees Celsius. ``rigid`` is the torque of the rigid body with
    the true ``parameters``, and ``scale`` the size of that of each joint, the unit of the effects.
    """

    robot: Robot
    parameters: Array
    motion: Motion
    fine: Motion
    step: float
    stride: int
    time: Array
    temperature: Array
    rigid: Array
    scale: Array
    rng: np.random.Generator

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return self.robot.n_joints

    @property
    def n_trajectories(self) -> int:
        """Number of trajectories."""
        return len(self.time)

    @cached_property
    def prismatic(self) -> NDArray[np.bool_]:
        """Mask of prismatic joints."""
        return np.array([kind == "prismatic" for kind in self.robot.joint_types])

    @cached_property
    def unit(self) -> Array:
        """Moderate motion of each joint: 1 rad or 0.1 m."""
        return np.where(self.prismatic, 0.1, 1.0)

    @cached_property
    def sign(self) -> Array:
        """Direction of dry friction, which a joint at rest keeps from its last motion."""
        return self.dry_sign(self.fine.q)

    def dry_sign(self, travel: Array) -> Array:
        """Direction of dry friction of any fine travel (n_trajectories, n_fine, ...) in rad."""
        return slip(np.diff(travel, axis=1) / SLIP)[:, :: self.stride][:, : self.n_samples]

    @property
    def n_samples(self) -> int:
        """Samples per trajectory."""
        return int(self.time.shape[1])

    def torque(self, **changes: Any) -> Array:
        """Rigid-body torque with other ``parameters``, ``gravity`` or accelerations."""
        m = self.motion
        arguments: dict[str, Any] = {"parameters": self.parameters} | changes
        n = self.n_joints
        flat = (a.reshape(-1, n) for a in (m.q, m.dq, m.ddq))
        return self.robot.inverse_dynamics(*flat, **arguments).reshape(m.q.shape)

    def zeros(self) -> Array:
        """Zero torque."""
        return np.zeros_like(self.rigid)

    def on(self, j: list[int], values: Array) -> Array:
        """Torque of some joints, zero on the others."""
        torque = self.zeros()
        torque[..., j] = values
        return torque


@dataclass
class Outcome:
    """Influence of an effect on a log: the torque that it adds, or changes of the logged torque.

    Joints are counted from 0. ``parameters`` are the true ones in SI units, arrays with one value
    per joint; ``variables`` are the signals on which an unknown effect depends. ``gain``, ``delay``
    (s) and ``limit`` change the logged torque of the joints. ``motor`` is the departure of the fine
    position and velocity of the motors from those of the links.
    """

    joints: list[int]
    parameters: dict[str, Any]
    formula: str
    torque: Array | None = None
    variables: tuple[str, ...] = ()
    gain: float = 1.0
    delay: float = 0.0
    limit: Array | None = None
    uses_temperature: bool = False
    replaces_coulomb: bool = False
    motor: tuple[Array, Array] | None = None


#: An effect: world, joints from 0, size of its torque relative to the scale of each joint.
Simulate = Callable[[World, list[int], float], Outcome]


def slip(travel: Array) -> Array:
    """Elastic-perfectly-plastic element: states in [-1, 1] that follow steps of travel.

    Steps along the second axis are in units of the travel from rest to slip.
    """
    moved = np.moveaxis(travel, 1, 0)
    states = np.empty((len(moved) + 1, *moved.shape[1:]))
    # the direction in which it first slips, to avoid a transient at the start
    total = np.cumsum(moved, axis=0)
    first = np.argmax(np.abs(total) > 1, axis=0)
    states[0] = np.sign(np.take_along_axis(total, first[None], axis=0)[0])
    state = states[0].copy()
    for k, step in enumerate(moved, start=1):
        np.add(state, step, out=state)
        np.minimum(state, 1.0, out=state)
        np.maximum(state, -1.0, out=state)
        states[k] = state
    return np.moveaxis(states, 0, 1)


def relax(target: Array, decay: Array, start: Array) -> Array:
    """States of ``z_k = z_(k-1) decay_k + target_k (1 - decay_k)`` along axis 1.

    This is the exact step of ``dz/ds = (target - z) / length`` with both held during the step, so
    stiff friction states need no smaller steps.
    """
    decays = np.moveaxis(decay, 1, 0)
    pulls = np.moveaxis(target * (1 - decay), 1, 0)
    states = np.empty((len(decays) + 1, *start.shape))
    states[0] = state = start.copy()
    for k in range(len(decays)):
        state = state * decays[k] + pulls[k]
        states[k + 1] = state
    return np.moveaxis(states, 0, 1)


def true_parameters(robot: Robot, rng: np.random.Generator) -> Array:
    """Inertial parameters that differ from the nominal ones by 10 to 20 % and stay physical.

    The pseudo-inertia matrix of each body is changed by a congruence, which keeps it positive
    definite [1]_.

    References
    ----------
    .. [1] P. M. Wensing, S. Kim, J.-J. E. Slotine, "Linear matrix inequalities for physically
       consistent inertial parameter identification", IEEE RA-L 3(1), 2018.
    """
    nominal = np.asarray(robot.inertial_parameters, dtype=float)
    changed = np.empty_like(nominal)
    for k, row in enumerate(nominal):
        P = pseudo_inertia(row)
        length = np.linalg.norm(row[1:4]) / row[0] if row[0] > 0 else 0.0
        A = np.eye(4)
        A[:3, :3] += 0.06 * rng.standard_normal((3, 3))
        A[:3, 3] = 0.12 * length * rng.standard_normal(3)
        mass = 1 + rng.choice([-1, 1]) * rng.uniform(0.1, 0.2)
        changed[k] = from_pseudo_inertia(mass * A @ P @ A.T)
    return changed


def pseudo_inertia(row: Array) -> Array:
    """4 x 4 pseudo-inertia matrix of ``(m, m c, Ixx, Ixy, Ixz, Iyy, Iyz, Izz)``."""
    mass, moment, inertia = inertial_parts(row)
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    return np.block([[second, moment[:, None]], [moment, mass]])


def from_pseudo_inertia(P: Array) -> Array:
    """Inverse of :func:`pseudo_inertia`."""
    inertia = np.trace(P[:3, :3]) * np.eye(3) - P[:3, :3]
    return inertial_vector(P[3, 3], P[:3, 3], inertia)
