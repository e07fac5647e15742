# SPDX-License-Identifier: BSD-3-Clause
"""Progress messages of long computations, for whatever listens to them.

A function calls :func:`tell`; the command line shows them in its bar. Nothing receives them in a
library, and then nothing happens.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

#: What is being done, and the share of it that is done (None where that is not known).
Listener = Callable[[str, float | None], None]
Item = TypeVar("Item")

_LISTENER: ContextVar[Listener | None] = ContextVar("skidyn_progress", default=None)


def tell(text: str, share: float | None = None) -> None:
    """Report what is being done.

    Parameters
    ----------
    text : str
        What is being done.
    share : float, optional
        Share of it that is done, 0 to 1.
    """
    listener = _LISTENER.get()
    if listener is not None:
        listener(text, share)


def track(items: Iterable[Item], text: str) -> Iterator[Item]:
    """Go through items and report before each how many are done.

    >>> with listening(lambda text, share: print(text, share)):
    ...     letters = list(track("ab", "Reading"))
    Reading 0.0
    Reading 0.5
    Reading 1.0
    """
    total = len(items) if isinstance(items, Sized) else None
    for k, item in enumerate(items):
        tell(text, k / total if total else None)
        yield item
    tell(text, 1.0)


@contextmanager
def listening(listener: Listener | None) -> Iterator[None]:
    """Pass what is reported inside the ``with`` block to a function, or to nobody."""
    token = _LISTENER.set(listener)
    try:
        yield
    finally:
        _LISTENER.reset(token)
