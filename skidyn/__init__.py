# SPDX-License-Identifier: BSD-3-Clause
"""Robot inverse dynamics for scikit-learn.

Identify a rigid-body model with friction, compare it with measurements, see where it fails, find
the missing physical effect, add it and compare the held-out errors.

Importing the package loads no submodule; each one is loaded when it is first used.
"""

import importlib
from typing import Any

__all__ = [
    "__version__",
    "committee",
    "datasets",
    "diagnosis",
    "effects",
    "evidence",
    "exceptions",
    "excitation",
    "explorer",
    "export",
    "fleet",
    "forecasting",
    "hybrid",
    "identification",
    "inspection",
    "load_model",
    "logs",
    "measurement",
    "metrics",
    "model_selection",
    "neural_network",
    "payload",
    "preprocessing",
    "report",
    "robots",
    "save_model",
    "show_versions",
    "simulation",
]

#: Modules of the names that are not submodules.
_HOMES = {
    "load_model": "skidyn._persistence",
    "save_model": "skidyn._persistence",
    "show_versions": "skidyn._version",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return importlib.import_module("skidyn._version").package_version()
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    if name in __all__:
        return importlib.import_module(f"skidyn.{name}")
    raise AttributeError(f"module 'skidyn' has no attribute {name!r}")


def __dir__() -> list[str]:
    return list(__all__)
