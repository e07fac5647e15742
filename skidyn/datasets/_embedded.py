# SPDX-License-Identifier: BSD-3-Clause
"""The log of the demonstration, simulated on request."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from skidyn.datasets._robots import load_panda
from skidyn.datasets.hidden_effects._simulator import make_hidden_effect_log

if TYPE_CHECKING:
    from sklearn.utils import Bunch


def load_demo_log() -> Bunch:
    """Log of a Panda arm whose fourth joint has pre-sliding friction and whose second has a spring.

    It is simulated on request with fixed random numbers; nothing is stored or downloaded.

    Returns
    -------
    Bunch
        As :func:`make_hidden_effect_log` returns it: ``frame``, ``X``, ``y``, ``truth``, ``robot``.

    Examples
    --------
    >>> from skidyn.datasets import load_demo_log
    >>> log = load_demo_log()
    >>> [effect["kind"] for effect in log.truth], log.y.shape
    (['dahl', 'spring'], (8000, 7))
    """
    effects: dict[str, dict[str, Any]] = {
        "dahl": {"joints": [4]},
        "spring": {"joints": [2], "magnitude": 0.6},
    }
    return make_hidden_effect_log(load_panda(), effects, n_trajectories=8, random_state=7)
