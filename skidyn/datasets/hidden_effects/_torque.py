# SPDX-License-Identifier: BSD-3-Clause
"""Simulated torques that depend on position, acceleration, temperature or time."""

from __future__ import annotations

import numpy as np

from skidyn._signals import Array
from skidyn.datasets.hidden_effects._friction import rms, scaled
from skidyn.datasets.hidden_effects._world import Outcome, Simulate, World


def offset(world: World, j: list[int], size: float) -> Outcome:
    """Constant torque of either sign."""
    tau0 = size * world.scale[j] * world.rng.choice([-1.0, 1.0], len(j))
    return Outcome(j, {"tau0": tau0}, "tau0", world.on(j, tau0))


def spring(world: World, j: list[int], size: float) -> Outcome:
    """Linear spring about a rest position near the middle of the motion."""
    q0 = _rest(world, j)
    k, torque = scaled(world, j, world.motion.q[..., j] - q0, size)
    return Outcome(j, {"k": k, "q0": q0}, "k*(q-q0)", torque)


def nonlinear_spring(world: World, j: list[int], size: float) -> Outcome:
    """Cubic spring."""
    q0 = _rest(world, j)
    k3, torque = scaled(world, j, (world.motion.q[..., j] - q0) ** 3, size)
    return Outcome(j, {"k3": k3, "q0": q0}, "k3*(q-q0)^3", torque)


def gravity_compensator(world: World, j: list[int], size: float) -> Outcome:
    """Coil spring between two points at a and b from the axis, turning with the joint."""
    a, b, rest = 0.12, 0.4, 0.25
    zero = _rest(world, j)
    angle = (world.motion.q[..., j] - zero) / world.unit[j]
    length = np.sqrt(a**2 + b**2 - 2 * a * b * np.cos(angle))
    stiffness, torque = scaled(world, j, (length - rest) / length * a * b * np.sin(angle), size)
    parameters = {"stiffness": stiffness, "q0": zero, "a": a, "b": b, "rest_length": rest}
    formula = "stiffness*(L-rest_length)*a*b*sin(q-q0)/L, L^2=a^2+b^2-2*a*b*cos(q-q0)"
    return Outcome(j, parameters, formula, torque)


def coupling_spring(world: World, j: list[int], size: float) -> Outcome:
    """Spring over two joints."""
    i, k = j
    ratio = -1.0 if world.unit[i] == world.unit[k] else float(-world.unit[i] / world.unit[k])
    x = world.motion.q[..., i] + ratio * world.motion.q[..., k]
    x0 = float(x.mean())
    level = size * float(np.sqrt(world.scale[i] * world.scale[k]))
    stiffness = level / max(float(x.std()), 1e-12)
    force = stiffness * (x - x0)
    torque = world.on([i, k], np.stack([force, ratio * force], axis=-1))
    formula = "tau_i=k*(q_i+ratio*q_j-x0), tau_j=ratio*tau_i"
    return Outcome([i, k], {"k": stiffness, "ratio": ratio, "x0": x0}, formula, torque)


def rotor_inertia(world: World, j: list[int], size: float) -> Outcome:
    """Inertia of the rotor, reflected by the gear."""
    Ia, torque = scaled(world, j, world.motion.ddq[..., j], size)
    return Outcome(j, {"Ia": Ia}, "Ia*ddq", torque)


def coupled_inertia(world: World, j: list[int], size: float) -> Outcome:
    """Inertia of a motor that turns with the sum of two joints."""
    i, k = j
    ratio = 1.0
    x = world.motion.ddq[..., i] + ratio * world.motion.ddq[..., k]
    level = size * float(np.sqrt(world.scale[i] * world.scale[k]))
    Ia = level / max(float(np.sqrt(np.mean(x**2))), 1e-12)
    torque = world.on([i, k], np.stack([Ia * x, ratio * Ia * x], axis=-1))
    formula = "tau_i=Ia*(ddq_i+ratio*ddq_j), tau_j=ratio*tau_i"
    return Outcome([i, k], {"Ia": Ia, "ratio": ratio}, formula, torque)


def torque_ripple(world: World, j: list[int], size: float) -> Outcome:
    """Torque that is periodic in the joint's position."""
    N = world.rng.choice([20.0, 36.0, 60.0, 100.0], len(j)) / world.unit[j]
    phase = world.rng.uniform(-np.pi, np.pi, len(j))
    A, torque = scaled(world, j, np.sin(N * world.motion.q[..., j] - phase), size)
    return Outcome(j, {"A": A, "N": N, "phase": phase}, "A*sin(N*q-phase)", torque)


def end_stop(world: World, j: list[int], size: float) -> Outcome:
    """Soft contact beyond a position that the motion reaches in a tenth of the samples."""
    side = world.rng.choice([-1.0, 1.0], len(j))
    q = side * world.motion.q[..., j]
    limit = np.quantile(q.reshape(-1, len(j)), 0.88, axis=0)
    k, torque = scaled(world, j, np.maximum(0.0, q - limit), size)
    torque[..., j] *= side
    parameters = {"k": k, "q_lim": side * limit, "side": side}
    return Outcome(j, parameters, "k*max(0,side*(q-q_lim))*side", torque)


def temperature_offset(world: World, j: list[int], size: float) -> Outcome:
    """Drift of a torque sensor with temperature."""
    warm = world.temperature[..., j] - 30.0
    slope = size * world.scale[j] / rms(warm - warm.mean(axis=(0, 1)))
    torque, parameters = world.on(j, slope * warm), {"dtau_dT": slope, "T0": 30.0}
    return Outcome(j, parameters, "dtau_dT*(T-T0)", torque, uses_temperature=True)


def cable(world: World, j: list[int], size: float) -> Outcome:
    """Unknown: a cable along two joints, pulling with the cosine of their difference."""
    i, k = j
    form = np.cos(world.motion.q[..., i] / world.unit[i] - world.motion.q[..., k] / world.unit[k])
    level = size * float(np.sqrt(world.scale[i] * world.scale[k]))
    a = level / max(float(form.std()), 1e-12)
    return Outcome(
        [i, k],
        {"a": a},
        f"a*cos(q{i + 1}-q{k + 1}) on joint {i + 1}, -0.6 of it on joint {k + 1}",
        world.on([i, k], np.stack([a * form, -0.6 * a * form], axis=-1)),
        variables=(f"q{i + 1}", f"q{k + 1}"),
    )


def clock_torque(world: World, j: list[int], size: float) -> Outcome:
    """Unknown: a torque periodic in time, independent of the motion."""
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
