# SPDX-License-Identifier: BSD-3-Clause
"""Hidden friction: dry and viscous, with and without memory."""

from __future__ import annotations

from typing import Any

import numpy as np

from skidyn._signals import Array
from skidyn.datasets.suite._hidden import Adds, Hidden, Maker, Moment, Setting, on


def _lacking(s: Setting, kind: str, name: str, sizes: Array, formula: str) -> Hidden:
    """Friction that all joints have and the base model lacks."""
    s.some(s.n_joints)  # unused, so that later random numbers do not change
    j = list(range(s.n_joints))
    return Hidden(kind, j, {name: sizes}, formula, (name,), missing_from_base=kind)


def stribeck(s: Setting) -> Hidden:
    j = s.some()
    more = s.coulomb[j] * s.rng.uniform(0.6, 1.0, len(j)) * s.strength
    speed = s.low_speed[j] * s.rng.uniform(0.06, 0.14, len(j))
    friction = on(j, lambda m: more * np.exp(-((m.dq[j] / speed) ** 2)))
    parameters = {"dF": more, "vs": speed, "delta": 2.0}
    formula = "dF*exp(-(|dq|/vs)^2)*sign(dq)"
    return Hidden("stribeck", j, parameters, formula, ("dF", "vs"), friction=friction)


def asymmetric(s: Setting) -> Hidden:
    j = s.some(2)
    slope = s.viscous[j] * s.rng.uniform(0.4, 0.6, len(j)) * s.strength
    level = s.coulomb[j] * s.rng.uniform(0.15, 0.3, len(j)) * s.strength
    torque = on(j, lambda m: slope * np.abs(m.dq[j]))
    friction = on(j, lambda m: level * np.sign(m.dq[j]))
    parameters = {"dFv": slope, "dFc": level}
    formula = "dFv*|dq| + dFc while it moves"
    return Hidden(
        "asymmetric_friction", j, parameters, formula, ("dFv",), torque=torque, friction=friction
    )


def nonlinear_viscous(s: Setting) -> Hidden:
    j, power = s.some(), float(s.rng.choice([0.5, 2.0, 3.0]))
    c = s.viscous[j] * s.rng.uniform(0.5, 0.8, len(j)) * s.strength
    c = c / (0.6 * s.speed[j]) ** (power - 1)

    def torque(m: Moment, out: Array) -> None:
        v = m.dq[j]
        if power >= 1:
            out[j] += c * np.sign(v) * np.abs(v) ** power
        else:  # a root has an infinite slope at rest, which an integrator cannot follow
            out[j] += c * v / (np.abs(v) + 0.01) ** (1 - power)

    parameters = {"c": c, "power": power}
    formula = "c*|dq|^power*sign(dq)"
    return Hidden("nonlinear_viscous", j, parameters, formula, ("power",), torque=torque)


def load_dependent(s: Setting) -> Hidden:
    j = s.some(s.n_joints)
    mu = np.minimum(0.25, s.rng.uniform(0.07, 0.12, len(j)) * s.strength)
    friction = on(j, lambda m: mu * np.abs(m.load[j]))
    formula = "mu*|load|*sign(dq)"
    return Hidden("load_dependent_friction", j, {"mu": mu}, formula, ("mu",), friction=friction)


def drift(s: Setting) -> Hidden:
    """As with temperature, but no temperature is logged."""
    hidden = _thermal(s, list(range(s.n_joints)))
    hidden.kind, hidden.scored, hidden.needs_temperature = "friction_drift", (), False
    hidden.accept = ("temperature_friction",)
    return hidden


def _thermal(s: Setting, j: list[int]) -> Hidden:
    span, share = s.rng.uniform(14, 22) / s.strength, -s.rng.uniform(0.003, 0.006)
    damping = on(j, lambda m: s.viscous[j] * (np.exp(-(m.temperature[j] - 30) / span) - 1))
    friction = on(j, lambda m: s.coulomb[j] * share * (m.temperature[j] - 30))
    parameters = {"Ts": span, "T0": 30.0, "dFv_dT": -s.viscous[j] / span}
    parameters["dFc_dT"] = share * s.coulomb[j]
    return Hidden(
        "temperature_friction",
        j,
        parameters,
        "Fv*(exp(-(T-T0)/Ts)-1)*dq + dFc_dT*(T-T0)*sign(dq)",
        ("dFv_dT",),
        damping=damping,
        friction=friction,
        needs_temperature=True,
    )


def by_position(s: Setting) -> Hidden:
    j = s.some(2, s.revolute)
    size = s.coulomb[j] * s.rng.uniform(0.5, 0.75, len(j)) * min(s.strength, 1.25)
    order, phase = s.rng.choice([1, 2], len(j)), s.rng.uniform(-np.pi, np.pi, len(j))
    friction = on(j, lambda m: size * np.cos(order * m.q[j] - phase))
    parameters = {"A": size, "n": order, "phase": phase}
    formula = "A*cos(n*q-phase)*sign(dq)"
    return Hidden("position_dependent_friction", j, parameters, formula, ("A",), friction=friction)


def coupled(s: Setting) -> Hidden:
    j, ratio = s.pair(), s.sign()
    dry = min(s.coulomb[j]) * s.rng.uniform(0.7, 1.0) * s.strength
    slope = min(s.viscous[j]) * s.rng.uniform(0.4, 0.7) * s.strength
    tendon = {"ratios": (1.0, ratio), "friction": dry, "damping": slope}
    return Hidden(
        "coupled_friction",
        j,
        {"Fc": dry, "Fv": slope, "ratio": ratio},
        "w=dq_i+ratio*dq_j; tau_i=Fc*sign(w)+Fv*w, tau_j=ratio*tau_i",
        ("Fc", "Fv"),
        tendon=tendon,
    )


def dahl(s: Setting) -> Hidden:
    j = s.some()
    travel = s.low_speed[j] * s.rng.uniform(0.015, 0.04, len(j)) * s.strength
    level, state = s.coulomb[j], np.zeros(len(j))

    def torque(m: Moment, out: Array) -> None:
        v = m.dq[j]
        goal = np.sign(v)
        state[:] = goal - (goal - state) * np.exp(-np.abs(v) * m.step / travel)
        out[j] += level * state

    parameters = {"sigma0": level / travel, "presliding": travel}
    formula = "Fc*z - Fc*sign(dq), dz=dq/presliding*(1-z*sign(dq))"
    return _with_memory("dahl", j, parameters, formula, state, torque)


def lugre(s: Setting) -> Hidden:
    j = s.some()
    travel = s.low_speed[j] * s.rng.uniform(0.008, 0.02, len(j)) * s.strength
    level, more = s.coulomb[j], s.coulomb[j] * s.rng.uniform(0.5, 0.8, len(j))
    speed = s.low_speed[j] * s.rng.uniform(0.06, 0.12, len(j))
    stiff = level / travel
    damp = 0.15 * np.sqrt(stiff * np.maximum(s.inertia[j], 0.02))
    state = np.zeros(len(j))

    def torque(m: Moment, out: Array) -> None:
        v = m.dq[j]
        g = level + more * np.exp(-((v / speed) ** 2))
        goal = np.sign(v) * g / stiff
        after = goal - (goal - state) * np.exp(-stiff * np.abs(v) * m.step / g)
        out[j] += stiff * after + damp * (after - state) / m.step
        state[:] = after

    parameters = {"sigma0": stiff, "sigma1": damp, "dF": more, "vs": speed, "presliding": travel}
    formula = "sigma0*z+sigma1*dz-Fc*sign(dq), dz=dq-sigma0*|dq|*z/g, g=Fc+dF*exp(-(dq/vs)^2)"
    return _with_memory("lugre", j, parameters, formula, state, torque)


def maxwell_slip(s: Setting) -> Hidden:
    j = s.some()
    travel = s.low_speed[j] * s.rng.uniform(0.02, 0.04, len(j)) * s.strength
    weights = np.array([0.3, 0.3, 0.25, 0.15])
    limit = travel[:, None] * np.array([0.15, 0.5, 1.2, 2.5])
    level, state = s.coulomb[j], np.zeros((len(j), 4))

    def torque(m: Moment, out: Array) -> None:
        state[:] = np.clip(state + (m.dq[j] * m.step)[:, None], -limit, limit)
        out[j] += level * (state / limit @ weights)

    parameters = {"presliding": travel, "elements": 4}
    formula = "four elastic-plastic elements in parallel - Fc*sign(dq)"
    return _with_memory("maxwell_slip", j, parameters, formula, state, torque)


def _with_memory(
    kind: str,
    j: list[int],
    parameters: dict[str, Any],
    formula: str,
    state: Array,
    torque: Adds,
) -> Hidden:
    family = tuple(sorted({"dahl", "lugre", "maxwell_slip"} - {kind}))
    return Hidden(
        kind,
        j,
        parameters,
        formula,
        ("presliding",),
        accept=family,
        replaces_coulomb=True,
        start=lambda: state.fill(0.0),
        torque=torque,
    )


FRICTION: dict[str, Maker] = {
    "asymmetric_friction": asymmetric,
    "coulomb": lambda s: _lacking(s, "coulomb", "Fc", s.coulomb, "Fc*sign(dq)"),
    "coupled_friction": coupled,
    "dahl": dahl,
    "friction_drift": drift,
    "load_dependent_friction": load_dependent,
    "lugre": lugre,
    "maxwell_slip": maxwell_slip,
    "nonlinear_viscous": nonlinear_viscous,
    "position_dependent_friction": by_position,
    "stribeck": stribeck,
    "temperature_friction": lambda s: _thermal(s, s.some(s.n_joints)),
    "viscous": lambda s: _lacking(s, "viscous", "Fv", s.viscous, "Fv*dq"),
}
