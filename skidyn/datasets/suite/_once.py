# SPDX-License-Identifier: BSD-3-Clause
"""Hidden effects in one trajectory only."""

from __future__ import annotations

from skidyn._signals import Array
from skidyn.datasets.suite._hidden import Hidden, Maker, Moment, Setting
from skidyn.datasets.suite._measurement import wrench_in
from skidyn.datasets.suite._structure import payload_in, spring_on


def _friction_once(s: Setting) -> Hidden:
    j, g = s.pick(1), s.recordings(1)
    level = s.coulomb[j] * s.rng.uniform(0.8, 1.3) * s.strength

    def friction(m: Moment, out: Array) -> None:
        if m.trajectory in g:
            out[j] += level

    accept = ("viscous", "friction_drift")
    return Hidden(
        "coulomb", j, {"Fc": level}, "Fc*sign(dq)", accept=accept, friction=friction, trajectories=g
    )


def _spring_once(s: Setting) -> Hidden:
    hidden = spring_on(s, s.pick(1))
    g, everywhere = s.recordings(1), hidden.torque
    assert everywhere is not None

    def torque(m: Moment, out: Array) -> None:
        if m.trajectory in g:
            everywhere(m, out)

    hidden.torque, hidden.trajectories, hidden.accept = torque, g, ("nonlinear_spring",)
    return hidden


ONCE: dict[str, Maker] = {
    "coulomb": _friction_once,
    "external_wrench": lambda s: wrench_in(s, s.recordings(1)),
    "payload": lambda s: payload_in(s, s.recordings(1)),
    "spring": _spring_once,
}
