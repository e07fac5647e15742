# SPDX-License-Identifier: BSD-3-Clause
"""The loop by hand: compare, click where it fails, see what would help, tick it, undo, save."""

from skidyn.explorer._server import serve
from skidyn.explorer._session import RankedEffect, Session

__all__ = [
    "RankedEffect",
    "Session",
    "serve",
]
