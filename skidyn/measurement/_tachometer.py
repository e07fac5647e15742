# SPDX-License-Identifier: BSD-3-Clause
"""Faults of a recorded velocity that leave it a function of the rate of the position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._consistency import way_and_area

#: Fewest windows, largest share of the squared difference that may remain with a fault, and least
#: offset, as a share of the root mean square velocity.
FEWEST, LEFT, LEAST = 50, 0.1, 0.03
#: Largest velocity of a clipped one, as a share of the largest rate of the position.
CLIPPED = 0.95


@dataclass(frozen=True)
class Fault:
    """Relation of a recorded velocity to the rate of its position.

    Attributes
    ----------
    kind : {"unsigned", "offset", "clipped"}
        The velocity is the magnitude of the rate, the rate and a constant, or the rate up to some
        limit.
    value : float, rad/s or m/s
        The constant or the limit; 0 for a magnitude.
    left : float
        Share of the squared difference between velocity and rate that remains with it.
    """

    kind: str
    value: float
    left: float


def find_fault(
    time: Array, position: Array, velocity: Array, segments: Sequence[slice]
) -> Fault | None:
    """The fault that explains the difference between a velocity and the rate of its position.

    Parameters
    ----------
    time : ndarray of shape (n_samples,), s
        Recorded clock.
    position, velocity : ndarray of shape (n_samples,)
        Signals of a joint, rad or m, and rad/s or m/s.
    segments : sequence of slice
        Continuous parts.

    Returns
    -------
    Fault or None
        None if the velocity is that rate, or none of these faults explains the difference.
    """
    way, area, span = way_and_area(time, position, velocity, segments)
    if len(way) < FEWEST or span <= 0:
        return None
    rate, told = way / span, area / span
    size = float(np.sqrt(np.mean(rate**2)))
    whole = float(np.mean((told - rate) ** 2))
    if size <= 0 or whole <= (LEAST * size) ** 2:
        return None
    offset = float(np.median(told - rate))
    limit = float(np.quantile(np.abs(told), 0.999))
    tried = {"offset": (offset, rate + offset)}
    if told.min() >= -LEAST * size and rate.min() < -size / 2:
        tried["unsigned"] = (0.0, np.abs(rate))
    if limit < CLIPPED * float(np.quantile(np.abs(rate), 0.999)):
        tried["clipped"] = (limit, np.clip(rate, -limit, limit))
    faults = [
        Fault(kind, value, float(np.mean((told - expected) ** 2)) / whole)
        for kind, (value, expected) in tried.items()
    ]
    best = min(faults, key=lambda fault: fault.left)
    return best if best.left < LEFT else None
