# SPDX-License-Identifier: BSD-3-Clause
"""Physical effects: what can be added to a rigid-body model, and the catalogue of all kinds."""

from skidyn.effects._base import Coefficient, Effect, Shape, Term
from skidyn.effects._catalogue import get_effect, list_effects, make_terms, register_effect
from skidyn.effects._formula import formula
from skidyn.effects._hysteresis import dahl_state, stop_state
from skidyn.effects._transformer import FrictionTransformer

__all__ = [
    "Coefficient",
    "Effect",
    "FrictionTransformer",
    "Shape",
    "Term",
    "dahl_state",
    "formula",
    "get_effect",
    "list_effects",
    "make_terms",
    "register_effect",
    "stop_state",
]
