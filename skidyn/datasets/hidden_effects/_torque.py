# SPDX-License-Identifier: BSD-3-Clause
"""Simulated torques that depend on position, acceleration, temperature or time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from skidyn.datasets.hidden_effects._friction import rms, scaled
from skidyn.datasets.hidden_effects._world import Outcome, Simulate, World

Array = NDArray[np.float64]


def offset(world: World, joints: Sequence[int], size: float) -> Outcome:
    """Constant torque of either sign."""
    j = list(joints)
    tau0 = size * world.scale[j] * world.rng.choice([-1.0, 1.0], len(j))
    torque = world.zeros()
    torque[..., j] = tau0
    return Outcome(j, {"tau0": tau0}, "tau0", torque)


def spring(world: World, joints: Sequence[int], size: float) -> Outcome:
    """Linear spring about a rest position near the middle of the motion."""
    j = list(joints)
    q0 = _rest(world, j)
    k, torque = scaled(world, j, world.motion.q[..., j] - q0, size)
    return Outcome(j, {"k": k, "q0": q0}, "k*(q-q0)", torque)


def nonlinear_spring(world: World, joints: Sequence[int], size: float) -> Outcome:
    """Cubic spring."""
    j = list(joints)
    q0 = _rest(world, j)
    k3, torque = scaled(world, j, (world.motion.q[..., j] - q0) ** 3, size)
    return Outcome(j, {"k3": k3, "q0": q0}, "k3*(q-q0)^3", torque)


def gravity_compensator(world: World, joints: Sequence[int], size: float) -> Outcome:
    """Coil spring between two points at a and b from the axis, turning with the joint."""
    j = list(joints)
    a, b, rest = 0.12, 0.4, 0.25
    zero = _rest(world, j)
    angle = (world.motion.q[..., j] - zero) / world.unit[j]
    length = np.sqrt(a**2 + b**2 - 2 * a * b * np.cos(angle))
    stiffness, torque = scaled(world, j, (length - rest) / length * a * b * np.sin(angle), size)
    parameters = {"stiffness": stiffness, "q0": zero, "a": a, "b": b, "rest_length": rest}
    formula = "stiffness*(L-rest_length)*a*b*sin(q-q0)/L, L^2=a^2+b^2-2*a*b*cos(q-q0)"
    return Outcome(j, parameters, formula, torque)


def coupling_spring(world: World, joints: Sequence[int], size: float) -> Outcome:
    """Spring over two joints."""
    i, k = joints
    ratio = -1.0 if world.unit[i] == world.unit[k] else float(-world.unit[i] / world.unit[k])
    x = world.motion.q[..., i] + ratio * world.motion.q[..., k]
    x0 = float(x.mean())
    level = size * float(np.sqrt(world.scale[i] * world.scale[k]))
    stiffness = level / max(float(x.std()), 1e-12)
    torque = world.zeros()
    torque[..., i] = stiffness * (x - x0)
    torque[..., k] = ratio * torque[..., i]
    formula = "tau_i=k*(q_i+ratio*q_j-x0), tau_j=ratio*tau_i"
    return Outcome([i, k], {"k": stiffness, "ratio": ratio, "x0": x0}, formula, torque)


def rotor_inertia(world: World, joints: Sequence[int], size: float) -> Outcome:
    """Inertia of the rotor, reflected by the gear."""
    Ia, torque = scaled(world, joints, world.motion.ddq[..., list(joints)], size)
    return Outcome(list(joints), {"Ia": Ia}, "Ia*ddq", torque)


def coupled_inertia(world: World, joints: Sequence[int], size: float) -> Outcome:
    """Inertia of a motor that turns with the sum of two joints."""
    i, k = joints
    ratio = 1.0
    x = world.motion.ddq[..., i] + ratio * world.motion.ddq[..., k]
    level = size * float(np.sqrt(world.scale[i] * world.scale[k]))
    Ia = level / max(float(np.sqrt(np.mean(x**2))), 1e-12)
    torque = world.zeros()
    torque[..., i], torque[..., k] = Ia * x, ratio * Ia * x
    formula = "tau_i=Ia*(ddq_i+ratio*ddq_j), tau_j=ratio*tau_i"
    return Outcome([i, k], {"Ia": Ia, "ratio": ratio}, formula, torque)


def torque_ripple(world: World, joints: Sequence[int], size: float) -> Outcome:
    """Torque that is periodic in the joint's position."""
    j = list(joints)
    N = world.rng.choice([20.0, 36.0, 60.0, 100.0], len(j)) / world.unit[j]
    phase = world.rng.uniform(-np.pi, np.pi, len(j))
    A, torque = scaled(world, j, np.sin(N * world.motion.q[..., j] - phase), size)
    return Outcome(j, {"A": A, "N": N, "phase": phase}, "A*sin(N*q-phase)", torque)


def end_stop(world: World, joints: Sequence[int], size: float) -> Outcome:
    """Soft contact beyond a position that the motion reaches in a tenth of the samples."""
    j = list(joints)
    side = world.rng.choice([-1.0, 1.0], len(j))
    q = side * world.motion.q[..., j]
    limit = np.quantile(q.reshape(-1, len(j)), 0.88, axis=0)
    k, torque = scaled(world, j, np.maximum(0.0, q - limit), size)
    torque[..., j] *= side
    parameters = {"k": k, "q_lim": side * limit, "side": side}
    return Outcome(j, parameters, "k*max(0,side*(q-q_lim))*side", torque)


def temperature_offset(world: World, joints: Sequence[int], size: float) -> Outcome:
    """Drift of a torque sensor with temperature."""
    j = list(joints)
    warm = world.temperature[..., j] - 30.0
    slope = size * world.scale[j] / rms(warm - warm.mean(axis=(0, 1)))
    torque = world.zeros()
    torque[..., j] = slope * warm
    parameters = {"dtau_dT": slope, "T0": 30.0}
    return Outcome(j, parameters, "dtau_dT*(T-T0)", torque, uses_temperature=True)


def cable(world: World, joints: Sequence[int], size: float) -> Outcome:
    """Unknown: a cable along two joints, pulling with the cosine of their difference."""
    i, k = joints
    form = np.cos(world.motion.q[..., i] / world.unit[i] - world.motion.q[..., k] / world.unit[k])
    level = size * float(np.sqrt(world.scale[i] * world.scale[k]))
    a = level / max(float(form.std()), 1e-12)
    torque = world.zeros()
    torque[..., i], torque[..., k] = a * form, -0.6 * a * form
    return Outcome(
        [i, k],
        {"a": a},
        f"a*cos(q{i + 1}-q{k + 1}) on joint {i + 1}, -0.6 of it on joint {k + 1}",
        torque,
        variables=(f"q{i + 1}", f"q{k + 1}"),
    )


def clock_torque(world: World, joints: Sequence[int], size: float) -> Outcome:
    """Unknown: a torque periodic in time, independent of the motion."""
    j = list(joints)
    frequency = float(world.rng.uniform(0.5, 0.9))
    form = np.sin(2 * np.pi * frequency * world.time)[..., None]
    a, torque = scaled(world, j, np.repeat(form, len(j), axis=2), size)
    parameters = {"a": a, "frequency": frequency}
    return Outcome(j, parameters, "a*sin(2*pi*frequency*t)", torque, variables=("time",))


def _rest(world: World, j: list[int]) -> Array:
    q = world.motion.q[..., j]
    return np.asarray(q.mean(axis=(0, 1)) + world.rng.uniform(-0.3, 0.3, len(j)) * world.unit[j])


TORQUE: dict[str, Simulate] = {
    "offset": offset,
    "spring": spring,
    "nonlinear_spring": nonlinear_spring,
    "gravity_compensator": gravity_compensator,
    "coupling_spring": coupling_spring,
    "rotor_inertia": rotor_inertia,
    "coupled_inertia": coupled_inertia,
    "torque_ripple": torque_ripple,
    "end_stop": end_stop,
    "temperature_offset": temperature_offset,
    "unknown_cable": cable,
    "unknown_clock": clock_torque,
}
