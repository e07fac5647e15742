# SPDX-License-Identifier: BSD-3-Clause
"""Physical effects that can be added to a rigid-body model, and their catalogue."""

from typing import TYPE_CHECKING, Any

from skidyn.effects._base import Effect
from skidyn.effects._catalogue import make_terms
from skidyn.effects._formula import formula
from skidyn.effects._hysteresis import dahl_state, stop_state
from skidyn.effects._parameters import Coefficient, Shape
from skidyn.effects._registry import (
    get_effect,
    list_effects,
    register_effect,
    unregister_effect,
)
from skidyn.effects._term import Term, TermSum

if TYPE_CHECKING:
    from skidyn.effects._transformer import FrictionTransformer

__all__ = [
    "Coefficient",
    "Effect",
    "FrictionTransformer",
    "Shape",
    "Term",
    "TermSum",
    "dahl_state",
    "formula",
    "get_effect",
    "list_effects",
    "make_terms",
    "register_effect",
    "stop_state",
    "unregister_effect",
]

# For other packages of skidyn; no part of the public interface.
from skidyn._signals import Signals as Signals
from skidyn.effects._catalogue import make_new_terms as make_new_terms
from skidyn.effects._hysteresis import Law as Law, PathMemory as PathMemory
from skidyn.effects._moments import starts as starts
from skidyn.effects._motor_load import MotorLoadFriction as MotorLoadFriction
from skidyn.effects._nameless import NamelessEffect as NamelessEffect
from skidyn.effects._nameless_periodic import ClockPeriodic as ClockPeriodic
from skidyn.effects._nameless_products import (
    Factor as Factor,
    ProductOfSignals as ProductOfSignals,
    ProductWithFunction as ProductWithFunction,
    ProductWithLoad as ProductWithLoad,
    SizeByRecording as SizeByRecording,
)
from skidyn.effects._nameless_signals import (
    FunctionOfSignals as FunctionOfSignals,
    FunctionOfSum as FunctionOfSum,
)
from skidyn.effects._registry import (
    nameless_kinds as nameless_kinds,
    searched_kinds as searched_kinds,
)
from skidyn.effects._smooth import (
    hats as hats,
    knots_between as knots_between,
    products as products,
)


def __getattr__(name: str) -> Any:
    if name == "FrictionTransformer":  # the only effect that needs scikit-learn, half a second
        from skidyn.effects._transformer import FrictionTransformer

        return FrictionTransformer
    raise AttributeError(f"module 'skidyn.effects' has no attribute {name!r}")
