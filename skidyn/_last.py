# SPDX-License-Identifier: BSD-3-Clause
"""Results that are asked for again with the same arrays, and computed once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import is_
from typing import Any


class LastResults:
    """The last result of each name, with the objects of which it was made."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[list[Any], Any]] = {}

    def get(self, name: str, made_of: Sequence[Any], make: Callable[[], Any]) -> Any:
        """Result of ``make``, computed again only if it is asked for with other objects.

        Parameters
        ----------
        name : str
            What it is; only the last result of a name is kept.
        made_of : sequence
            All arrays on which it depends, the same objects if it has not changed.
        make : callable
            Function that returns the result, which must not be changed.
        """
        kept, found = self._kept.get(name, ([], None))
        if name not in self._kept or len(kept) != len(made_of) or not all(map(is_, kept, made_of)):
            found = make()
            self._kept[name] = list(made_of), found
        return found
