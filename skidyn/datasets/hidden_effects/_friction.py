# SPDX-License-Identifier: BSD-3-Clause
"""Simulated friction: functions of velocity, load, position, temperature and time."""

from __future__ import annotations

import numpy as np

from skidyn._signals import Array
from skidyn.datasets.hidden_effects._world import Outcome, Simulate, World


def rms(values: Array) -> Array:
    """Root mean square over trajectories and samples, per joint."""
    return np.asarray(np.sqrt(np.mean(values**2, axis=(0, 1))))


def scaled(world: World, j: list[int], form: Array, size: float) -> tuple[Array, Array]:
    """Coefficients that give each form (.., len(j)) the desired size, and the torque."""
    coefficient = size * world.scale[j] / np.maximum(rms(form), 1e-12)
    return coefficient, world.on(j, coefficient * form)


def viscous(world: World, j: list[int], size: float) -> Outcome:
    """Friction proportional to velocity."""
    Fv, torque = scaled(world, j, world.motion.dq[..., j], size)
    return Outcome(j, {"Fv": Fv}, "Fv*dq", torque)


def coulomb(world: World, j: list[int], size: float) -> Outcome:
    """Dry friction; at rest it keeps the direction of the last motion."""
    Fc, torque = scaled(world, j, world.sign[..., j], size)
    return Outcome(j, {"Fc": Fc}, "Fc*sign(dq)", torque)


def stribeck(world: World, j: list[int], size: float) -> Outcome:
    """More dry friction at low speed."""
    vs = world.rng.uniform(0.07, 0.13, len(j)) * world.unit[j]
    form = np.exp(-((world.motion.dq[..., j] / vs) ** 2)) * world.sign[..., j]
    dF = size * world.scale[j]
    parameters = {"dF": dF, "vs": vs, "delta": 2.0}
    return Outcome(j, parameters, "dF*exp(-(|dq|/vs)^2)*sign(dq)", world.on(j, dF * form))


def asymmetric_friction(world: World, j: list[int], size: float) -> Outcome:
    """Viscous and dry friction that differ between the directions."""
    dFv, torque = scaled(world, j, np.abs(world.motion.dq[..., j]), size)
    dFc = 0.3 * size * world.scale[j]
    torque[..., j] += dFc
    return Outcome(j, {"dFv": dFv, "dFc": dFc}, "dFv*|dq| + dFc", torque)


def nonlinear_viscous(world: World, j: list[int], size: float) -> Outcome:
    """Friction that grows with a power of velocity other than one."""
    power = float(world.rng.choice([0.5, 2.0]))
    dq = world.motion.dq[..., j]
    c, torque = scaled(world, j, np.abs(dq) ** power * np.sign(dq), size)
    return Outcome(j, {"c": c, "power": power}, "c*|dq|^power*sign(dq)", torque)


def load_dependent_friction(world: World, j: list[int], size: float) -> Outcome:
    """Dry friction proportional to the load of the gear."""
    mu, torque = scaled(world, j, np.abs(world.rigid[..., j]) * world.sign[..., j], size)
    return Outcome(j, {"mu": mu}, "mu*|tau_rigid_body|*sign(dq)", torque)


def temperature_friction(world: World, j: list[int], size: float) -> Outcome:
    """Viscous friction that falls exponentially as the joint warms up, dry friction linearly."""
    warm = world.temperature[..., j] - 30.0
    # at least +-20 % of friction over the session, for any requested size
    level = 4 * size * world.scale[j]
    dq, sign = world.motion.dq[..., j], world.sign[..., j]
    Fv = level / np.maximum(rms(dq), 1e-12)
    centred = warm - warm.mean(axis=(0, 1))
    factor = np.exp(-warm / 25.0)
    slope = Fv * np.sum(centred * factor, axis=(0, 1)) / np.sum(centred**2, axis=(0, 1))
    return Outcome(
        j,
        {"dFv_dT": slope, "dFc_dT": -0.004 * level, "T0": 30.0, "Ts": 25.0},
        "Fv*(exp(-(T-T0)/Ts)-1)*dq + dFc_dT*(T-T0)*sign(dq)",
        world.on(j, Fv * (factor - 1) * dq - 0.004 * level * warm * sign),
        uses_temperature=True,
    )


def friction_drift(world: World, j: list[int], size: float) -> Outcome:
    """Friction that decays with the time since the start of the session."""
    t = (world.time - world.time[0, 0])[..., None]
    constant = 0.5 * float(t.max())
    decay = np.exp(-t / constant)
    level = 1.5 * size * world.scale[j]
    dq, sign = world.motion.dq[..., j], world.sign[..., j]
    Fv = level / np.maximum(rms(dq), 1e-12)
    torque = world.on(j, (Fv * dq + 0.5 * level * sign) * decay)
    parameters = {"dFv": -Fv, "dFc": -0.5 * level, "time_constant": constant}
    formula = "-(dFv*dq + dFc*sign(dq))*exp(-t/time_constant)"
    return Outcome(j, parameters, formula, torque)


def position_dependent_friction(world: World, j: list[int], size: float) -> Outcome:
    """Dry friction whose level varies with the joint's own position."""
    n = world.rng.choice([1.0, 2.0], len(j)) / world.unit[j]
    phase = world.rng.uniform(-np.pi, np.pi, len(j))
    form = np.cos(n * world.motion.q[..., j] - phase) * world.sign[..., j]
    A, torque = scaled(world, j, form, size)
    parameters = {"A": A, "n": n, "phase": phase}
    return Outcome(j, parameters, "A*cos(n*q-phase)*sign(dq)", torque)


def coupled_friction(world: World, j: list[int], size: float) -> Outcome:
    """Friction between two joints whose relative motion is dq_i + r dq_j."""
    i, k = j
    ratio = 1.0
    rate = world.motion.dq[..., i] + ratio * world.motion.dq[..., k]
    sign = world.dry_sign(world.fine.q[..., i] + ratio * world.fine.q[..., k])
    level = size * float(np.sqrt(world.scale[i] * world.scale[k]))
    Fc, Fv = 0.7 * level, 0.7 * level / max(float(np.sqrt(np.mean(rate**2))), 1e-12)
    force = Fc * sign + Fv * rate
    torque = world.on([i, k], np.stack([force, ratio * force], axis=-1))
    formula = "w=dq_i+ratio*dq_j; tau_i=Fc*sign(w)+Fv*w, tau_j=ratio*tau_i"
    return Outcome([i, k], {"Fc": Fc, "Fv": Fv, "ratio": ratio}, formula, torque)


def cross_drag(world: World, j: list[int], size: float) -> Outcome:
    """Unknown: drag of one joint that grows with the speed of another."""
    i, k = j
    dq = world.motion.dq
    c, torque = scaled(world, [i], (dq[..., i] * np.abs(dq[..., k]))[..., None], size)
    return Outcome(
        [i],
        {"c": float(c[0])},
        f"c*dq{i + 1}*|dq{k + 1}| on joint {i + 1}",
        torque,
        variables=(f"dq{i + 1}", f"dq{k + 1}"),
    )


def pose_dependent_friction(world: World, j: list[int], size: float) -> Outcome:
    """Unknown: dry friction of one joint that depends on the position of another."""
    i, k = j
    form = np.sin(world.motion.q[..., k] / world.unit[k]) * world.sign[..., i]
    a, torque = scaled(world, [i], form[..., None], size)
    return Outcome(
        [i],
        {"a": float(a[0])},
        f"a*sin(q{k + 1})*sign(dq{i + 1}) on joint {i + 1}",
        torque,
        variables=(f"q{k + 1}", f"dq{i + 1}"),
    )


FRICTION: dict[str, Simulate] = {
    "viscous": viscous,
    "coulomb": coulomb,
    "stribeck": stribeck,
    "asymmetric_friction": asymmetric_friction,
    "nonlinear_viscous": nonlinear_viscous,
    "load_dependent_friction": load_dependent_friction,
    "temperature_friction": temperature_friction,
    "friction_drift": friction_drift,
    "position_dependent_friction": position_dependent_friction,
    "coupled_friction": coupled_friction,
    "unknown_cross_drag": cross_drag,
    "unknown_pose_friction": pose_dependent_friction,
}
