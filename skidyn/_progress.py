# SPDX-License-Identifier: BSD-3-Clause
"""Progress messages of long computations.

A function calls :func:`tell`; the command line shows the messages in its bar. In a library nothing
receives them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

#: Description of the task, and its finished share (None if unknown).
Listener = Callable[[str, float | None], None]
Item = TypeVar("Item")

_LISTENER: ContextVar[Listener | None] = ContextVar("skidyn_progress", default=None)


def tell(text: str, share: float | None = None) -> None:
    """Report the progress of a task, and its finished share from 0 to 1 if it is known."""
    listener = _LISTENER.get()
    if listener is not None:
        listener(text, share)


def track(items: Iterable[Item], text: str) -> Iterator[Item]:
    """Iterate over items and report the finished share before each.

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
    """Pass reports inside the ``with`` block to a function, or discard them."""
    token = _LISTENER.set(listener)
    try:
        yield
    finally:
        _LISTENER.reset(token)
