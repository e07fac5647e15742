# SPDX-License-Identifier: BSD-3-Clause
"""Simulated faults of the torque signal: gain, delay, saturation."""

from __future__ import annotations

import numpy as np

from skidyn.datasets.hidden_effects._world import Outcome, Simulate, World


def torque_gain(world: World, j: list[int], size: float) -> Outcome:
    """Logged torque too large or too small by a factor."""
    epsilon = float(0.6 * size * world.rng.choice([-1.0, 1.0]))
    parameters = {"epsilon": epsilon}
    return Outcome(j, parameters, "logged=(1+epsilon)*tau", gain=1 + epsilon)


def time_delay(world: World, j: list[int], size: float) -> Outcome:
    """Logged torque delayed relative to the positions."""
    delay = 0.08 * size
    formula = "tau_logged(t)=tau(t-delay), relative to the positions"
    return Outcome(j, {"delay": delay}, formula, delay=delay)


def saturation(world: World, j: list[int], size: float) -> Outcome:
    """Logged torque clipped at a limit that is often reached."""
    share = min(0.3 * size, 0.5)
    limit = np.quantile(np.abs(world.rigid[..., j]).reshape(-1, len(j)), 1 - share, axis=0)
    return Outcome(j, {"limit": limit}, "clip(tau, -limit, limit)", limit=limit)


SENSOR: dict[str, Simulate] = {
    "torque_gain": torque_gain,
    "time_delay": time_delay,
    "saturation": saturation,
}
