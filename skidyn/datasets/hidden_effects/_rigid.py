# SPDX-License-Identifier: BSD-3-Clause
"""Simulated loads, forces at the tool and a base that is not level."""

from __future__ import annotations

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn._signals import Array
from skidyn.datasets.hidden_effects._friction import rms
from skidyn.datasets.hidden_effects._world import LOADED_SHARE, Outcome, Simulate, World
from skidyn.dynamics import inertial_vector


def payload(world: World, j: list[int], size: float) -> Outcome:
    """An additional body fixed to the last link in some trajectories."""
    com = world.rng.uniform(-0.03, 0.03, 3) + np.array([0.0, 0.0, 0.08])
    added = np.zeros_like(world.parameters)
    added[-1] = point_body(1.0, com, radius=0.05)
    per_kilogram = world.torque(parameters=world.parameters + added) - world.rigid
    mass = _strongest(world, per_kilogram, size)
    loaded = _some_trajectories(world)
    torque = world.zeros()
    torque[loaded] = mass * per_kilogram[loaded]
    parameters = {"mass": mass, "com": com, "trajectories": [k + 1 for k in loaded]}
    formula = "rigid body on the last link in some trajectories (com in the frame of that link)"
    return Outcome([world.n_joints - 1], parameters, formula, torque, variables=("trajectory",))


def base_tilt(world: World, j: list[int], size: float) -> Outcome:
    """Gravity in a different direction than in the URDF."""
    tilt = np.deg2rad(float(np.clip(20 * size, 0.0, 60.0)))
    heading = world.rng.uniform(-np.pi, np.pi)
    nominal = np.asarray(world.robot.gravity, dtype=float)
    if not np.linalg.norm(nominal) > 0:
        raise SkidynError("base_tilt: the robot has no gravity whose direction could change.")
    aside = np.cross(nominal, [0.0, 1.0, 0.0] if abs(nominal[1]) < 5 else [1.0, 0.0, 0.0])
    across = np.cross(nominal, aside) / np.linalg.norm(nominal)
    direction = (np.cos(heading) * aside + np.sin(heading) * across) / np.linalg.norm(aside)
    gravity = np.cos(tilt) * nominal + np.sin(tilt) * np.linalg.norm(nominal) * direction
    torque = world.torque(gravity=gravity) - world.rigid
    parameters = {
        "tilt_deg": float(np.rad2deg(tilt)),
        "gravity": gravity,
        "gx": float(gravity[0]),
        "gy": float(gravity[1]),
    }
    formula = "gravity vector in the base frame other than in the URDF"
    return Outcome(list(range(world.n_joints)), parameters, formula, torque)


def external_wrench(world: World, j: list[int], size: float) -> Outcome:
    """A constant force at the last link, in base coordinates, in some trajectories."""
    direction = world.rng.standard_normal(3)
    direction /= np.linalg.norm(direction)
    per_newton = -_tool_torque(world, np.broadcast_to(direction, (*world.rigid.shape[:2], 3)))
    newtons = _strongest(world, per_newton, size)
    pushed = _some_trajectories(world)
    torque = world.zeros()
    torque[pushed] = newtons * per_newton[pushed]
    parameters = {"force": newtons * direction, "trajectories": [k + 1 for k in pushed]}
    formula = "-J^T F at the frame of the last link, in some trajectories"
    return Outcome([], parameters, formula, torque, variables=("trajectory",))


def environment_contact(world: World, j: list[int], size: float) -> Outcome:
    """A soft horizontal plane under the tool."""
    q = world.motion.q.reshape(-1, world.n_joints)
    position, _ = world.robot.forward_kinematics(q)
    height = position[:, 2].reshape(world.rigid.shape[:2])
    if np.ptp(height) < 1e-3:
        raise SkidynError("environment_contact: the tool of this robot stays at one height.")
    z0 = float(np.quantile(height, 0.15))
    force = np.zeros((*height.shape, 3))
    force[..., 2] = np.maximum(0.0, z0 - height)
    per_stiffness = -_tool_torque(world, force)
    stiffness = _strongest(world, per_stiffness, size)
    torque = stiffness * per_stiffness
    parameters = {"z0": z0, "k": stiffness}
    formula = "-J^T [0, 0, k*max(0, z0-z)] at the frame of the last link"
    return Outcome([], parameters, formula, torque, variables=("tool position z",))


def point_body(mass: float, com: Array, radius: float) -> Array:
    """Inertial parameters of a ball about the frame origin."""
    inertia = 0.4 * mass * radius**2 * np.eye(3)
    inertia += mass * (com @ com * np.eye(3) - np.outer(com, com))
    return inertial_vector(mass, mass * com, inertia)


def _tool_torque(world: World, force: Array) -> Array:
    """``J^T F`` for forces in base coordinates at the last body."""
    q = world.motion.q.reshape(-1, world.n_joints)
    linear = world.robot.jacobian(q)[:, :3]
    torque = np.einsum("tij,ti->tj", linear, force.reshape(-1, 3))
    return np.asarray(torque.reshape(world.rigid.shape))


def _strongest(world: World, per_unit: Array, size: float) -> float:
    """Magnitude at which the most affected loaded joint has the desired size."""
    loaded = world.scale > LOADED_SHARE * world.scale.max()
    share = np.where(loaded, rms(per_unit) / world.scale, 0.0)
    if not share.max() > 0:
        raise SkidynError("the effect causes no torque in any joint of this robot.")
    return float(size / share.max())


def _some_trajectories(world: World) -> list[int]:
    """About a third of the trajectories, at least one and never all; counted from 0."""
    n = world.n_trajectories
    if n < 2:
        raise SkidynError("the effect acts in some trajectories only; two at least are needed.")
    chosen = world.rng.choice(n, size=max(1, round(n / 3)), replace=False)
    return sorted(int(k) for k in chosen)


RIGID: dict[str, Simulate] = {
    "payload": payload,
    "base_tilt": base_tilt,
    "external_wrench": external_wrench,
    "environment_contact": environment_contact,
}
