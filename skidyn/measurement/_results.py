# SPDX-License-Identifier: BSD-3-Clause
"""Results that several checks or fits use, computed once."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

_Made = TypeVar("_Made")


class Results:
    """Results by their name, and by the arguments for which they were asked."""

    def __init__(self) -> None:
        self._kept: dict[str, dict[Hashable, Any]] = {}

    def get(
        self, name: str, key: Hashable, make: Callable[[], _Made], most: int | None = None
    ) -> _Made:
        """Result of ``make``, which is called if this one is not kept.

        Parameters
        ----------
        name : str
            What it is.
        key : hashable
            Arguments on which it depends.
        make : callable
            Function that returns the result, which must not be changed.
        most : int, optional
            Number of last results of this name that are kept; all by default.
        """
        kept = self._kept.setdefault(name, {})
        if key not in kept:
            made = make()
            while most is not None and len(kept) >= most:
                del kept[next(iter(kept))]
            kept[key] = made
        found: _Made = kept[key]
        return found
