# SPDX-License-Identifier: BSD-3-Clause
"""Robot inverse dynamics for scikit-learn.

Identify a rigid-body model with friction, compare it with measurements, see where it fails, learn
which physical effect is missing, add it and watch the held-out error fall.

Importing the package loads no submodule; each one is loaded when it is first used.
"""

import importlib
from typing import Any

from skidyn._version import package_version, show_versions

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

_PERSISTENCE = frozenset({"load_model", "save_model"})
_SUBMODULES = frozenset(__all__) - {"__version__", "show_versions"} - _PERSISTENCE


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return package_version()
    if name in _PERSISTENCE:
        return getattr(importlib.import_module("skidyn._persistence"), name)
    if name in _SUBMODULES:
        return importlib.import_module(f"skidyn.{name}")
    raise AttributeError(f"module 'skidyn' has no attribute {name!r}")


def __dir__() -> list[str]:
    return list(__all__)
