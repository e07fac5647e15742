# SPDX-License-Identifier: BSD-3-Clause
"""Import of packages that only some users need."""

import importlib
from types import ModuleType


def import_optional(name: str, *, extra: str) -> ModuleType:
    """Import an optional package, or raise an ImportError that states the extra to install.

    For a dotted name the innermost module is returned.

    >>> import_optional("json", extra="io").__name__
    'json'
    """
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        package = name.partition(".")[0]
        # A module missing inside an installed package is a broken installation: keep the error.
        if error.name is None or error.name.partition(".")[0] != package:
            raise
        raise ImportError(
            f"This function needs the package {package!r}, which is not installed. "
            f"Install it with: pip install 'skidyn[{extra}]'",
            name=name,
        ) from error
