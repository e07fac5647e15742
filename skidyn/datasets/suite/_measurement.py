# SPDX-License-Identifier: BSD-3-Clause
"""Hidden effects of drives and sensors, and external forces."""

from __future__ import annotations

import numpy as np

from skidyn._signals import Array
from skidyn.datasets.suite._hidden import Hidden, Maker, Moment, Setting, on


def offset(s: Setting) -> Hidden:
    j = s.some()
    size = s.torque[j] * s.rng.uniform(0.08, 0.16, len(j)) * s.strength
    size = size * s.rng.choice([-1, 1], len(j))

    def log(rows: dict[str, Array]) -> None:
        rows["tau"][:, j] += size

    accept = ("asymmetric_friction",)
    return Hidden("offset", j, {"tau0": size}, "tau0", ("tau0",), accept=accept, log=log)


def torque_gain(s: Setting) -> Hidden:
    j = s.some(2)
    gain = s.rng.uniform(0.07, 0.13, len(j)) * s.strength * s.rng.choice([-1, 1], len(j))

    def log(rows: dict[str, Array]) -> None:
        rows["tau"][:, j] *= 1 + gain

    formula = "logged torque = (1+epsilon)*torque"
    return Hidden("torque_gain", j, {"epsilon": gain}, formula, ("epsilon",), log=log)


def time_delay(s: Setting) -> Hidden:
    every = s.rng.random() < 0.6
    j = list(range(s.n_joints)) if every else s.pick(1)
    delay = s.rng.uniform(0.006, 0.016) * s.strength
    return Hidden(
        "time_delay",
        j,
        {"delay": delay},
        "logged torque(t) = torque(t-delay)",
        ("delay",),
        anywhere=every,
        delay=dict.fromkeys(j, delay),
    )


def saturation(s: Setting) -> Hidden:
    j = s.some(2)
    hidden = Hidden("saturation", j, {}, "the log is clipped at +-limit", ("limit",))

    def log(rows: dict[str, Array]) -> None:
        limit = np.quantile(np.abs(rows["tau"][:, j]), 0.9, axis=0)
        hidden.parameters["limit"] = limit
        rows["tau"][:, j] = np.clip(rows["tau"][:, j], -limit, limit)

    hidden.log = log
    return hidden


def torque_ripple(s: Setting) -> Hidden:
    j, order = s.some(2, s.revolute), float(s.rng.choice([12, 24, 60, 101, 160, 200]))
    share = s.rng.uniform(0.22, 0.4, len(j)) * s.strength
    size = share * s.coulomb[j] + 0.015 * s.torque[j]
    phase = s.rng.uniform(-np.pi, np.pi, len(j))
    torque = on(j, lambda m: size * np.sin(order * m.q[j] - phase))
    parameters = {"A": size, "N": order, "phase": phase}
    return Hidden("torque_ripple", j, parameters, "A*sin(N*q-phase)", ("N",), torque=torque)


def temperature_offset(s: Setting) -> Hidden:
    j = s.some(2)
    slope = s.torque[j] * s.rng.uniform(0.05, 0.1, len(j)) * s.strength / 8
    slope = slope * s.rng.choice([-1, 1], len(j))

    def log(rows: dict[str, Array]) -> None:
        rows["tau"][:, j] += slope * (rows["temperature"][:, j] - 30)

    return Hidden(
        "temperature_offset",
        j,
        {"dtau_dT": slope, "T0": 30.0},
        "dtau_dT*(T-T0)",
        ("dtau_dT",),
        log=log,
        needs_temperature=True,
    )


def wrench_in(s: Setting, trajectories: list[int]) -> Hidden:
    force = s.rng.normal(size=3) * [1, 1, 0.3]
    force *= s.push * s.rng.uniform(0.6, 1.0) * s.strength / np.linalg.norm(force)

    def tool_force(m: Moment, tool: Array) -> Array | None:
        return force if m.trajectory in trajectories else None

    return Hidden(
        "external_wrench",
        [],
        {"force": force, "trajectories": trajectories},
        "a constant force on the last link's origin in these trajectories",
        ("force",),
        ("trajectory",),
        anywhere=True,
        trajectories=trajectories,
        tool_force=tool_force,
    )


def environment_contact(s: Setting) -> Hidden:
    height = s.tool[:, 2]
    z0 = float(np.quantile(height, 0.12))
    k = 2.5 * s.push * s.strength / max(z0 - float(height.min()), 0.02)

    def tool_force(m: Moment, tool: Array) -> Array | None:
        depth = z0 - tool[2]
        return np.array([0, 0, k * depth]) if depth > 0 else None

    return Hidden(
        "environment_contact",
        [],
        {"k": k, "z0": z0},
        "soft floor: upward force k*max(0,z0-z) on the last link's origin",
        ("z0",),
        ("tool position z",),
        anywhere=True,
        tool_force=tool_force,
    )


MEASUREMENT: dict[str, Maker] = {
    "environment_contact": environment_contact,
    "external_wrench": lambda s: wrench_in(s, s.recordings(min(3, s.n_trajectories - 1))),
    "offset": offset,
    "saturation": saturation,
    "temperature_offset": temperature_offset,
    "time_delay": time_delay,
    "torque_gain": torque_gain,
    "torque_ripple": torque_ripple,
}
