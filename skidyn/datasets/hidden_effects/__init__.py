# SPDX-License-Identifier: BSD-3-Clause
"""Simulated logs of robots with an effect that the model lacks."""

from skidyn.datasets.hidden_effects._simulator import hidden_effect_kinds, make_hidden_effect_log

__all__ = [
    "hidden_effect_kinds",
    "make_hidden_effect_log",
]
