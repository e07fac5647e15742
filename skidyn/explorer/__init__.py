# SPDX-License-Identifier: BSD-3-Clause
"""Interactive search for missing effects: compare, rank and add effects, undo, save."""

from skidyn.explorer._server import serve
from skidyn.explorer._session import RankedEffect, Session

__all__ = [
    "RankedEffect",
    "Session",
    "serve",
]
