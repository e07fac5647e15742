# SPDX-License-Identifier: BSD-3-Clause
"""Simulated play and elasticity between motor and link.

Positions are logged on the motor side, and the link has another position.
"""

from __future__ import annotations

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn._signals import Array
from skidyn.datasets.hidden_effects._world import Outcome, Simulate, World

#: Natural frequency (rad/s) of the contact of the teeth, and its damping per rate of approach.
CONTACT_FREQUENCY, CONTACT_DAMPING = 80.0, 3.0


def joint_elasticity(world: World, j: list[int], size: float) -> Outcome:
    """Torsion spring between motor and link.

    A robot with elastic joints is differentially flat in its link positions [1]_: for a given
    motion of the links, spring torque and motor position follow exactly, without an integration.

    References
    ----------
    .. [1] A. De Luca, "Feedforward/feedback laws for the control of flexible robots", IEEE ICRA,
       2000.
    """
    from scipy.interpolate import CubicSpline

    load = world.rigid[..., j]
    # a large deflection, not that of a stiff gear: 0.12 rad at the usual size of 0.25
    K = np.sqrt(np.mean(load**2, axis=(0, 1))) / (0.12 * size * world.unit[j])
    sample_time = world.step * world.stride * np.arange(world.n_samples)
    fine_time = world.step * np.arange(world.fine.q.shape[1])
    spline = CubicSpline(sample_time, load / K, axis=1)
    deflection, rate = np.zeros_like(world.fine.q), np.zeros_like(world.fine.q)
    deflection[..., j] = spline(fine_time)
    rate[..., j] = spline(fine_time, 1)
    return Outcome(
        j,
        {"K": K},
        "logged position is of the motor; link position = q - tau_link/K",
        motor=(deflection, rate),
    )


def backlash(world: World, j: list[int], size: float) -> Outcome:
    """Play between motor and link, integrated through a stiff contact.

    The motor follows the planned motion; the link lags by ``delta``, which obeys
    ``M_ii delta'' = tau_rigid - tau_contact(delta, delta')`` along that motion.
    """
    if len(j) != 1:
        raise SkidynError("backlash is simulated on one joint; give one in joints.")
    i = j[0]
    gap = float(0.04 * size * world.unit[i])
    q = world.motion.q.reshape(-1, world.n_joints)
    mass = world.robot.mass_matrix(q, parameters=world.parameters)[:, :, i]
    mass = mass.reshape(world.rigid.shape)
    delta, acceleration = _contact(world, world.rigid[..., i] / mass[..., i], gap)
    link = q.copy()
    link[:, i] -= delta.ravel()
    gravity = [world.robot.gravity_torque(p, parameters=world.parameters) for p in (link, q)]
    # joint i: the contact torque less the rigid one; other joints: the reaction of the link
    torque = (gravity[0] - gravity[1]).reshape(mass.shape) - mass * acceleration[..., None]
    return Outcome([i], {"gap": gap}, "dead zone between motor and link", torque)


def _contact(world: World, demand: Array, gap: float) -> tuple[Array, Array]:
    """``delta`` and its acceleration on the clock of the log, for a demanded acceleration.

    The contact force per inertia is ``w^2 depth (1 + c delta')`` on either side of the gap
    [1]_: its damping grows with the depth, so the force neither jumps at contact nor pulls.

    References
    ----------
    .. [1] K. H. Hunt, F. R. E. Crossley, "Coefficient of restitution interpreted as damping in
       vibroimpact", J. Applied Mechanics 42(2), 1975.
    """
    fine_time = world.step * np.arange(world.fine.q.shape[1])
    sample_time = world.step * world.stride * np.arange(world.n_samples)
    demand = np.stack([np.interp(fine_time, sample_time, row) for row in demand])
    stiff, half, h = CONTACT_FREQUENCY**2, gap / 2, world.step
    delta = np.sign(demand[:, 0]) * half + demand[:, 0] / stiff
    rate = np.zeros_like(delta)
    deltas, accelerations = np.empty_like(demand), np.empty_like(demand)
    for k in range(demand.shape[1]):
        depth = delta - np.minimum(np.maximum(delta, -half), half)
        approach = CONTACT_DAMPING / max(gap, 1e-9) * np.sign(depth) * rate / CONTACT_FREQUENCY
        acceleration = demand[:, k] - stiff * depth * np.minimum(np.maximum(1 + approach, 0.0), 4.0)
        deltas[:, k], accelerations[:, k] = delta, acceleration
        rate = rate + h * acceleration
        delta = delta + h * rate
    at_samples = slice(None, world.stride * world.n_samples, world.stride)
    return deltas[:, at_samples], accelerations[:, at_samples]


TRANSMISSION: dict[str, Simulate] = {"joint_elasticity": joint_elasticity, "backlash": backlash}
