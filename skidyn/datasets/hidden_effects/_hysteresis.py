# SPDX-License-Identifier: BSD-3-Clause
"""Simulated pre-sliding friction: states integrated along the motion at fine steps.

All three replace the usual dry friction of the joint.
"""

from __future__ import annotations

import numpy as np

from skidyn._signals import Array
from skidyn.datasets.hidden_effects._world import Outcome, Simulate, World, relax, slip

#: Maxwell slip: relative thresholds and shares of the elements.
THRESHOLDS = (0.15, 0.5, 1.2)
SHARES = (0.35, 0.35, 0.3)


def dahl(world: World, j: list[int], size: float) -> Outcome:
    """Dahl friction: ``dz = dq (1 - sigma0 z sign(dq) / Fc)``, torque ``sigma0 z``."""
    j, travel, presliding, Fc = _joint_travel(world, j, size)
    decay = np.exp(-np.abs(travel) / presliding)
    z = relax(np.sign(travel), decay, _start(travel))
    return _outcome(
        world,
        j,
        Fc * z,
        {"Fc": Fc, "presliding": presliding, "sigma0": Fc / presliding},
        "sigma0*z, dz=dq*(1-sigma0*z/Fc*sign(dq)), presliding=Fc/sigma0",
    )


def lugre(world: World, j: list[int], size: float) -> Outcome:
    """LuGre friction: bristles with a Stribeck curve and a little damping."""
    j, travel, presliding, Fc = _joint_travel(world, j, size)
    vs = world.rng.uniform(0.08, 0.14, len(j)) * world.unit[j]
    dF = 0.4 * Fc
    curve = 1 + dF / Fc * np.exp(-((travel / world.step / vs) ** 2))
    z = relax(np.sign(travel) * curve, np.exp(-np.abs(travel) / presliding / curve), _start(travel))
    rate = np.diff(z, axis=1, prepend=z[:, :1]) / world.step
    return _outcome(
        world,
        j,
        Fc * (z + 0.002 * rate),
        {"Fc": Fc, "dF": dF, "vs": vs, "presliding": presliding, "sigma0": Fc / presliding},
        "sigma0*z + sigma1*dz/dt, dz/dt=dq-sigma0*|dq|*z/(Fc+dF*exp(-(dq/vs)^2))",
    )


def maxwell_slip(world: World, j: list[int], size: float) -> Outcome:
    """Elastic-perfectly-plastic elements in parallel."""
    j, travel, presliding, Fc = _joint_travel(world, j, size)
    force = sum(
        share * slip(travel / (presliding * threshold))
        for share, threshold in zip(SHARES, THRESHOLDS, strict=True)
    )
    return _outcome(
        world,
        j,
        Fc * force,
        {
            "Fc": Fc,
            "presliding": presliding,
            "relative_thresholds": list(THRESHOLDS),
            "weights": list(SHARES),
        },
        "Fc*sum_i w_i*stop_i(q), stop_i slips after presliding*threshold_i",
    )


def _joint_travel(world: World, j: list[int], size: float) -> tuple[list[int], Array, Array, Array]:
    presliding = world.rng.uniform(0.014, 0.026, len(j)) * world.unit[j]
    return j, np.diff(world.fine.q[..., j], axis=1), presliding, size * world.scale[j]


def _start(travel: Array) -> Array:
    """Fully slipped in the direction of the first motion."""
    first = np.argmax(travel != 0, axis=1)
    return np.sign(np.take_along_axis(travel, first[:, None], axis=1)[:, 0])


def _outcome(
    world: World, j: list[int], fine_torque: Array, parameters: dict[str, object], formula: str
) -> Outcome:
    torque = world.on(j, fine_torque[:, :: world.stride][:, : world.n_samples])
    return Outcome(j, parameters, formula, torque, replaces_coulomb=True)


HYSTERESIS: dict[str, Simulate] = {"dahl": dahl, "lugre": lugre, "maxwell_slip": maxwell_slip}
