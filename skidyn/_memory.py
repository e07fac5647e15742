# SPDX-License-Identifier: BSD-3-Clause
"""Memory that is free returns to the system."""

from __future__ import annotations

import ctypes
import sys
from functools import cache
from typing import Any


def give_back() -> None:
    """Return free memory of the heap to the system, where the C library is glibc.

    It keeps what hundreds of arrays of medium size leave, as those of a search do, since anything
    may lie above them. For a long log this is several hundred megabytes, in addition to what the
    next step allocates.
    """
    trim = _trim()
    if trim is not None:
        trim(0)


@cache
def _trim() -> Any:
    """The function of glibc; None with another C library."""
    if sys.platform != "linux":
        return None
    return getattr(ctypes.CDLL(None), "malloc_trim", None)
