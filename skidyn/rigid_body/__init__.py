# SPDX-License-Identifier: BSD-3-Clause
"""Rigid-body models: dynamics, base parameters, physical consistency, identification."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from skidyn.rigid_body._base_parameters import BaseParameters, find_base_parameters
    from skidyn.rigid_body._consistency import is_consistent, make_consistent
    from skidyn.rigid_body._constraints import BodyConstraints
    from skidyn.rigid_body._from_evidence import regressor_from_evidence
    from skidyn.rigid_body._instrumental import repetition_instruments
    from skidyn.rigid_body._rbd_regressor import RBDRegressor
    from skidyn.rigid_body._uncertainty import bootstrap_coefficients

__all__ = [
    "BaseParameters",
    "BodyConstraints",
    "RBDRegressor",
    "bootstrap_coefficients",
    "find_base_parameters",
    "is_consistent",
    "make_consistent",
    "regressor_from_evidence",
    "repetition_instruments",
]

# The engine under a Robot lives in this package, and RBDRegressor stands on Robot: names are loaded
# when they are first used, so that neither has to wait for the other.
_HOMES = {
    "BaseParameters": "skidyn.rigid_body._base_parameters",
    "BodyConstraints": "skidyn.rigid_body._constraints",
    "RBDRegressor": "skidyn.rigid_body._rbd_regressor",
    "bootstrap_coefficients": "skidyn.rigid_body._uncertainty",
    "find_base_parameters": "skidyn.rigid_body._base_parameters",
    "is_consistent": "skidyn.rigid_body._consistency",
    "make_consistent": "skidyn.rigid_body._consistency",
    "regressor_from_evidence": "skidyn.rigid_body._from_evidence",
    "repetition_instruments": "skidyn.rigid_body._instrumental",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
