# SPDX-License-Identifier: BSD-3-Clause
"""Hidden effects, and the state on which they may depend."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from skidyn._plain import plain
from skidyn._signals import Array


@dataclass
class Setting:
    """A robot, its motions and their usual sizes, from which an effect's parameters are chosen.

    Arrays have one value per joint; ``positions`` and ``tool`` are rows of planned motion.
    """

    rng: np.random.Generator
    strength: float
    centre: Array
    stroke: Array
    speed: Array
    acceleration: Array
    sliders: Array
    viscous: Array
    coulomb: Array
    rotor: Array
    torque: Array
    inertia: Array
    stiffness: Array
    payload: float
    push: float
    positions: Array
    tool: Array
    n_trajectories: int
    duration: float

    @property
    def n_joints(self) -> int:
        return len(self.centre)

    @property
    def revolute(self) -> list[int]:
        return [j for j in range(self.n_joints) if not self.sliders[j]]

    @property
    def low_speed(self) -> Array:
        """Speed below which details of dry friction are visible; m/s for sliders."""
        return np.where(self.sliders, 0.1, 1.0)

    def some(self, most: int = 3, pool: Sequence[int] | None = None) -> list[int]:
        """One to ``most`` joints."""
        pool = range(self.n_joints) if pool is None else pool
        count = int(self.rng.integers(1, min(most, len(pool)) + 1))
        return sorted(self.pick(count, pool))

    def pick(self, count: int, pool: Sequence[int] | None = None) -> list[int]:
        """Different joints in random order, as many as there are of the ``count``."""
        pool = list(range(self.n_joints) if pool is None else pool)
        return [int(j) for j in self.rng.choice(pool, min(count, len(pool)), replace=False)]

    def pair(self) -> list[int]:
        i = int(self.rng.integers(0, self.n_joints - 1))
        return [i, i + 1]

    def sign(self) -> float:
        return float(self.rng.choice([-1.0, 1.0]))

    def quantile(self, j: int, share: float) -> float:
        """Position of joint ``j`` below which it spends that share of the planned motion."""
        return float(np.quantile(self.positions[:, j], share))

    def recordings(self, count: int) -> list[int]:
        return sorted(int(g) for g in self.rng.choice(self.n_trajectories, count, replace=False))

    def intervals(
        self, seconds: tuple[float, float], share: float, most: int
    ) -> dict[int, list[tuple[float, float]]]:
        """Start and end in s since the trajectory's start, in a share of the trajectories."""
        chosen = self.recordings(max(2, round(share * self.n_trajectories)))
        out = {}
        for g in chosen:
            lengths = self.rng.uniform(*seconds, int(self.rng.integers(1, most + 1)))
            starts = [float(self.rng.uniform(0.1, self.duration - d - 0.1)) for d in lengths]
            out[g] = [(s, s + float(d)) for s, d in zip(starts, lengths, strict=True)]
        return out


@dataclass
class Moment:
    """State of the simulated robot at one step, for effects.

    ``clock`` counts seconds since the first recording, ``since`` since the trajectory's start;
    ``load`` is the load of each joint at the last step.
    """

    trajectory: int
    step: float
    clock: float
    since: float
    q: Array
    dq: Array
    ddq: Array
    load: Array
    temperature: Array


#: Adds to an array of shape (n_joints,): resisting torque, friction level or damping.
Adds = Callable[[Moment, Array], None]


def on(j: int | list[int], value: Callable[[Moment], Any]) -> Adds:
    """Adds a value to the entries of one or several joints."""

    def add(m: Moment, out: Array) -> None:
        out[j] += value(m)

    return add


@dataclass
class Hidden:
    """An effect: its influence on the plant or the log, and its truth.

    Torques have the sign of the actuator's: ``tau = rigid body + friction + torque``. Joints and
    trajectories are numbered from 0 here and from 1 in the truth.
    """

    kind: str
    joints: list[int]
    parameters: dict[str, Any]
    formula: str
    scored: tuple[str, ...] = ()
    variables: tuple[str, ...] = ()
    accept: tuple[str, ...] = ()
    anywhere: bool = False
    trajectories: list[int] | None = None
    # the plant
    tendon: dict[str, Any] | None = None
    compliance: dict[int, dict[str, float]] = field(default_factory=dict)
    gravity: Array | None = None
    payload: dict[str, Any] | None = None
    replaces_coulomb: bool = False
    # forces while it moves
    start: Callable[[], None] | None = None
    torque: Adds | None = None
    friction: Adds | None = None
    damping: Adds | None = None
    tool_force: Callable[[Moment, Array], Array | None] | None = None
    # the log
    delay: dict[int, float] = field(default_factory=dict)
    log: Callable[[dict[str, Array]], None] | None = None
    needs_temperature: bool = False
    missing_from_base: str | None = None

    def truth(self) -> dict[str, Any]:
        """Truth for the comparison with answers; joints and trajectories counted from 1."""
        out: dict[str, Any] = {
            "kind": self.kind,
            "joints": [j + 1 for j in self.joints],
            "parameters": {
                name: plain(_counted_from_one(name, value))
                for name, value in self.parameters.items()
            },
            "formula": self.formula,
            "scored_parameters": list(self.scored),
            "variables": list(self.variables),
            "accept": list(self.accept),
            "anywhere": self.anywhere,
        }
        if self.trajectories is not None:
            out["trajectories"] = [g + 1 for g in self.trajectories]
        return out


def _counted_from_one(name: str, value: Any) -> Any:
    """A parameter of the truth; trajectories in it are those of the log."""
    if name == "trajectories":
        return [g + 1 for g in value]
    return {g + 1: times for g, times in value.items()} if name == "when" else value


#: Draws an effect's parameters.
Maker = Callable[[Setting], Hidden]
