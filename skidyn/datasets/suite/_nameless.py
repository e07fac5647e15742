# SPDX-License-Identifier: BSD-3-Clause
"""Hidden torques outside the catalogue: the right answer is ``unknown``, with joints and signals.

``x`` is the distance of a position from the joint's centre, in units of its stroke.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from skidyn._signals import Array
from skidyn.datasets.suite._hidden import Hidden, Maker, Moment, Setting, on


def _nameless(
    s: Setting, j: list[int], parameters: dict[str, Any], formula: str, *signals: str, **more: Any
) -> Hidden:
    return Hidden("unknown", j, parameters, formula, variables=tuple(signals), **more)


def _x(s: Setting, m: Moment, j: int) -> float:
    return float((m.q[j] - s.centre[j]) / s.stroke[j])


def product_of_positions(s: Setting) -> Hidden:
    i, k = s.pick(2)
    a = 0.5 * s.torque[i] * s.strength
    torque = on(i, lambda m: a * _x(s, m, i) * _x(s, m, k))
    formula = f"a*x{i + 1}*x{k + 1}"
    return _nameless(s, [i], {"a": a}, formula, f"q{i + 1}", f"q{k + 1}", torque=torque)


def sum_of_positions(s: Setting) -> Hidden:
    j = s.pick(3)
    a = 0.35 * s.torque[j[0]] * s.strength
    torque = on(j[0], lambda m: a * np.tanh(1.5 * sum(_x(s, m, k) for k in j)))
    formula = "a*tanh(1.5*(" + "+".join(f"x{k + 1}" for k in j) + "))"
    return _nameless(s, j[:1], {"a": a}, formula, *(f"q{k + 1}" for k in j), torque=torque)


def cable_between_joints(s: Setting) -> Hidden:
    i, k = sorted(s.pick(2, s.revolute))
    a = 0.35 * min(s.torque[i], s.torque[k]) * s.strength

    def torque(m: Moment, out: Array) -> None:
        pull = a * np.cos(m.q[i] - m.q[k])
        out[i] += pull
        out[k] -= 0.6 * pull

    formula = f"a*cos(q{i + 1}-q{k + 1}) and -0.6 of it"
    return _nameless(s, [i, k], {"a": a}, formula, f"q{i + 1}", f"q{k + 1}", torque=torque)


def one_cause_on_three(s: Setting) -> Hidden:
    j = s.pick(3)
    ratio = np.array([1.0, -0.7, 0.6])[: len(j)]
    a = 0.3 * s.torque[j] * s.strength * ratio
    torque = on(j, lambda m: a * np.tanh(3 * _x(s, m, j[0])))
    formula = f"a_k*tanh(3*x{j[0] + 1})"
    return _nameless(s, j, {"a": a}, formula, f"q{j[0] + 1}", torque=torque)


def narrow_bump(s: Setting) -> Hidden:
    i = s.pick(1)[0]
    at, width = s.quantile(i, s.rng.uniform(0.25, 0.75)), s.stroke[i] * s.rng.uniform(0.04, 0.09)
    a = 0.6 * s.torque[i] * s.strength * s.sign()
    torque = on(i, lambda m: a * np.exp(-(((m.q[i] - at) / width) ** 2)))
    parameters = {"a": a, "q0": at, "w": width}
    return _nameless(s, [i], parameters, "a*exp(-((q-q0)/w)^2)", f"q{i + 1}", torque=torque)


def drag_by_other_speed(s: Setting) -> Hidden:
    i, k = s.pick(2)
    c = 1.2 * s.viscous[i] * s.strength / s.speed[k]
    torque = on(i, lambda m: c * m.dq[i] * abs(m.dq[k]))
    formula = f"c*dq{i + 1}*|dq{k + 1}|"
    return _nameless(s, [i], {"c": c}, formula, f"dq{i + 1}", f"dq{k + 1}", torque=torque)


def friction_by_other_position(s: Setting) -> Hidden:
    i, k = s.pick(2)
    a = 0.8 * s.coulomb[i] * min(s.strength, 1.2)
    friction = on(i, lambda m: a * np.sin(2 * _x(s, m, k)))
    formula = f"a*sin(2*x{k + 1})*sign(dq{i + 1})"
    return _nameless(s, [i], {"a": a}, formula, f"q{k + 1}", f"dq{i + 1}", friction=friction)


def friction_by_other_load(s: Setting) -> Hidden:
    i, k = s.pick(2)
    mu = 0.9 * s.coulomb[i] * s.strength / s.torque[k]
    friction = on(i, lambda m: min(mu * abs(m.load[k]), 3 * s.coulomb[i]))
    return _nameless(s, [i], {"mu": mu}, f"mu*|load {k + 1}|*sign(dq{i + 1})", friction=friction)


def since_reversal(s: Setting) -> Hidden:
    i = s.pick(1)[0]
    a = s.coulomb[i] * s.rng.uniform(0.5, 0.8) * s.strength
    fade = s.stroke[i] * s.rng.uniform(0.1, 0.3)
    state = {"way": 0.0, "travel": 0.0}

    def start() -> None:
        state.update(way=0.0, travel=0.0)

    def friction(m: Moment, out: Array) -> None:
        v = float(m.dq[i])
        if v * state["way"] < 0:
            state["travel"] = 0.0
        state["way"] = float(np.sign(v)) or state["way"]
        state["travel"] += abs(v) * m.step
        out[i] += a * np.exp(-state["travel"] / fade)

    return _nameless(
        s,
        [i],
        {"a": a, "d": fade},
        "a*exp(-travel since reversal/d)*sign(dq)",
        f"q{i + 1}",
        f"dq{i + 1}",
        accept=("dahl", "lugre", "maxwell_slip"),
        start=start,
        friction=friction,
    )


def since_start(s: Setting) -> Hidden:
    i = s.pick(1)[0]
    a, fade = 0.35 * s.torque[i] * s.strength, s.duration * s.rng.uniform(0.12, 0.3)
    torque = on(i, lambda m: a * np.exp(-max(m.since, 0.0) / fade))
    formula = "a*exp(-t/tau), t since the trajectory's start"
    return _nameless(s, [i], {"a": a, "tau": fade}, formula, "time", torque=torque)


def square_on_the_clock(s: Setting) -> Hidden:
    j = s.some(2)
    rate, phase = float(np.exp(s.rng.uniform(*np.log([0.4, 6.0])))), s.rng.uniform()
    a = 0.15 * s.torque[j] * s.strength
    torque = on(j, lambda m: a if (m.clock * rate + phase) % 1 < 0.5 else -a)
    parameters = {"a": a, "frequency": rate}
    return _nameless(s, j, parameters, "a*square(frequency*time)", "time", torque=torque)


def pushes(s: Setting) -> Hidden:
    when = s.intervals((0.25, 0.8), 0.5, 2)
    force = s.rng.normal(size=3)
    force *= s.push * s.rng.uniform(1.0, 1.6) * s.strength / np.linalg.norm(force)

    def tool_force(m: Moment, tool: Array) -> Array | None:
        for begin, end in when.get(m.trajectory, ()):
            if begin <= m.since <= end:
                return np.asarray(force * np.sin(np.pi * (m.since - begin) / (end - begin)))
        return None

    return _nameless(
        s,
        [],
        {"force": force, "when": when},
        "half-sine pushes at the tool in some seconds",
        accept=("external_wrench",),
        anywhere=True,
        tool_force=tool_force,
    )


def drags_for_a_while(s: Setting) -> Hidden:
    i, when = s.pick(1)[0], s.intervals((0.5, 1.2), 0.5, 2)
    a = s.coulomb[i] * s.rng.uniform(0.8, 1.2) * s.strength
    friction = on(i, lambda m: a * any(b <= m.since <= e for b, e in when.get(m.trajectory, ())))
    return _nameless(
        s, [i], {"a": a, "when": when}, "a*sign(dq) in some seconds", friction=friction
    )


def field_around_a_point(s: Setting) -> Hidden:
    centre = s.tool[s.rng.integers(len(s.tool))] + 0.03 * s.rng.normal(size=3)
    spread = float(np.sqrt(((s.tool - s.tool.mean(axis=0)) ** 2).sum(axis=1).mean()))
    width = spread * s.rng.uniform(0.3, 0.5)
    a = s.push * s.rng.uniform(1.2, 2.0) * s.strength * s.sign()

    def tool_force(m: Moment, tool: Array) -> Array | None:
        r = tool - centre
        return np.asarray(a * r / width * np.exp(0.5 - r @ r / (2 * width**2)))

    parameters = {"a": a, "width": width, "centre": centre}
    formula = "force a*r/w*exp(1/2-r^2/2w^2) away from a point, at the tool"
    return _nameless(
        s, [], parameters, formula, "tool position", anywhere=True, tool_force=tool_force
    )


NAMELESS: dict[str, Maker] = {
    "cable_between_joints": cable_between_joints,
    "drag_by_other_speed": drag_by_other_speed,
    "drags_for_a_while": drags_for_a_while,
    "field_around_a_point": field_around_a_point,
    "friction_by_other_load": friction_by_other_load,
    "friction_by_other_position": friction_by_other_position,
    "narrow_bump": narrow_bump,
    "one_cause_on_three": one_cause_on_three,
    "product_of_positions": product_of_positions,
    "pushes": pushes,
    "since_reversal": since_reversal,
    "since_start": since_start,
    "square_on_the_clock": square_on_the_clock,
    "sum_of_positions": sum_of_positions,
}
