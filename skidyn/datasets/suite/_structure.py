# SPDX-License-Identifier: BSD-3-Clause
"""Hidden inertia, gravity, springs and transmissions."""

from __future__ import annotations

import numpy as np

from skidyn._signals import Array
from skidyn.datasets.suite._hidden import Hidden, Maker, Setting, on


def rotor_inertia(s: Setting) -> Hidden:
    accept = ("coupled_inertia",) if s.n_joints == 2 else ()
    return Hidden(
        "rotor_inertia",
        list(range(s.n_joints)),
        {"Ia": s.rotor},
        "Ia*ddq",
        ("Ia",),
        accept=accept,
        missing_from_base="rotor_inertia",
    )


def coupled_inertia(s: Setting) -> Hidden:
    j, ratio = s.pair(), s.sign()
    inertia = max(0.15 * np.sqrt(np.prod(s.inertia[j])), 0.04) * s.rng.uniform(1, 2) * s.strength
    return Hidden(
        "coupled_inertia",
        j,
        {"Ia": inertia, "ratio": ratio},
        "a=ddq_i+ratio*ddq_j; tau_i=Ia*a, tau_j=ratio*Ia*a",
        ("Ia",),
        tendon={"ratios": (1.0, ratio), "inertia": inertia},
    )


def payload_in(s: Setting, trajectories: list[int]) -> Hidden:
    mass = s.payload * s.rng.uniform(0.4, 0.8) * s.strength
    com = np.append(s.rng.uniform(-0.03, 0.03, 2), s.rng.uniform(0.06, 0.14))
    inertia = mass * np.array([0.003, 0.003, 0.002])
    return Hidden(
        "payload",
        [s.n_joints - 1],
        {"mass": mass, "com": com, "inertia": inertia, "trajectories": trajectories},
        "a body on the last link in these trajectories",
        ("mass",),
        ("trajectory",),
        anywhere=True,
        trajectories=trajectories,
        payload={"mass": mass, "com": com, "inertia": inertia},
    )


def base_tilt(s: Setting) -> Hidden:
    tilt, heading = np.deg2rad(s.rng.uniform(3, 7) * s.strength), s.rng.uniform(-np.pi, np.pi)
    sideways = np.sin(tilt) * np.array([np.cos(heading), np.sin(heading)])
    gravity = 9.81 * np.append(sideways, -np.cos(tilt))
    return Hidden(
        "base_tilt",
        list(range(s.n_joints)),
        {"gravity": gravity, "tilt_deg": np.rad2deg(tilt)},
        "gravity has another direction than in the URDF",
        ("tilt_deg",),
        anywhere=True,
        gravity=gravity,
    )


def spring_on(s: Setting, j: list[int]) -> Hidden:
    k = s.torque[j] * s.rng.uniform(0.25, 0.45, len(j)) * s.strength / s.stroke[j]
    rest = s.centre[j] + s.stroke[j] * s.rng.uniform(-0.4, 0.4, len(j))
    torque = on(j, lambda m: k * (m.q[j] - rest))
    return Hidden("spring", j, {"k": k, "q0": rest}, "k*(q-q0)", ("k",), torque=torque)


def nonlinear_spring(s: Setting) -> Hidden:
    j = s.some(2)
    k = s.torque[j] * s.rng.uniform(0.5, 0.9, len(j)) * s.strength / s.stroke[j] ** 3
    rest = s.centre[j] + s.stroke[j] * s.rng.uniform(-0.25, 0.25, len(j))
    torque = on(j, lambda m: k * (m.q[j] - rest) ** 3)
    return Hidden(
        "nonlinear_spring", j, {"k3": k, "q0": rest}, "k3*(q-q0)^3", ("k3",), torque=torque
    )


def gravity_compensator(s: Setting) -> Hidden:
    j = s.pick(1, s.revolute[:2])
    short, long, rest = 0.16, 0.45, 0.22
    angle = s.centre[j[0]] + s.rng.uniform(-0.3, 0.3) - 1.2

    def shape(q: Array) -> Array:
        x = q - angle
        length = np.sqrt(short**2 + long**2 - 2 * short * long * np.cos(x))
        return np.asarray((length - rest) * short * long * np.sin(x) / length)

    reach = shape(s.centre[j[0]] + s.stroke[j[0]] * np.linspace(-1, 1, 50))
    k = s.torque[j[0]] * s.rng.uniform(0.6, 1.0) * s.strength / np.ptp(reach)
    torque = on(j, lambda m: k * shape(m.q[j]))
    return Hidden(
        "gravity_compensator",
        j,
        {"k": k, "a": short, "b": long, "L0": rest, "angle0": angle},
        "coil spring on a lever: L^2=a^2+b^2-2ab*cos(q-angle0); k*(L-L0)*dL/dq",
        variables=(f"q{j[0] + 1}",),
        accept=("nonlinear_spring", "spring"),
        torque=torque,
    )


def coupling_spring(s: Setting) -> Hidden:
    j, ratio = s.pair(), s.sign()
    k = min(s.torque[j] / s.stroke[j]) * s.rng.uniform(0.35, 0.6) * s.strength
    rest = s.centre[j] @ [1, ratio] + s.rng.uniform(-0.3, 0.3) * min(s.stroke[j])
    return Hidden(
        "coupling_spring",
        j,
        {"k": k, "ratio": ratio, "offset": rest},
        "x=q_i+ratio*q_j-offset; tau_i=k*x, tau_j=ratio*k*x",
        ("k",),
        tendon={"ratios": (1.0, ratio), "stiffness": k, "length": rest},
    )


def joint_elasticity(s: Setting) -> Hidden:
    j = s.some(2, s.revolute)
    k = s.stiffness[j] * s.rng.uniform(0.8, 1.3, len(j)) / s.strength
    compliance = {i: {"stiffness": x, "damping": x / 3000} for i, x in zip(j, k, strict=True)}
    return Hidden(
        "joint_elasticity",
        j,
        {"K": k},
        "positions are the motor's; link position = q - load/K",
        ("K",),
        anywhere=True,
        compliance=compliance,
    )


def backlash(s: Setting) -> Hidden:
    j = s.pick(1, s.revolute)
    gap = s.rng.uniform(0.003, 0.006) * s.strength
    return Hidden(
        "backlash",
        j,
        {"gap": gap},
        "positions are the motor's; the link is free within +-gap/2",
        ("gap",),
        anywhere=True,
        compliance={j[0]: {"gap": gap, "damping": 0.02 * s.viscous[j[0]]}},
    )


def end_stop(s: Setting) -> Hidden:
    j = s.some(2)
    side = s.rng.choice([-1.0, 1.0], len(j))
    limit = np.array([s.quantile(i, 0.88 if d > 0 else 0.12) for i, d in zip(j, side, strict=True)])
    last = np.array([s.quantile(i, 1.0 if d > 0 else 0.0) for i, d in zip(j, side, strict=True)])
    k = s.torque[j] * s.rng.uniform(0.7, 1.1, len(j)) * s.strength / np.abs(last - limit)
    torque = on(j, lambda m: side * k * np.maximum(0, side * (m.q[j] - limit)))
    return Hidden(
        "end_stop",
        j,
        {"k": k, "q_lim": limit, "side": side},
        "k*max(0,side*(q-q_lim))*side",
        ("q_lim",),
        torque=torque,
    )


STRUCTURE: dict[str, Maker] = {
    "backlash": backlash,
    "base_tilt": base_tilt,
    "coupled_inertia": coupled_inertia,
    "coupling_spring": coupling_spring,
    "end_stop": end_stop,
    "gravity_compensator": gravity_compensator,
    "joint_elasticity": joint_elasticity,
    "nonlinear_spring": nonlinear_spring,
    "payload": lambda s: payload_in(s, s.recordings(max(2, s.n_trajectories // 2))),
    "rotor_inertia": rotor_inertia,
    "spring": lambda s: spring_on(s, s.some(2)),
}
