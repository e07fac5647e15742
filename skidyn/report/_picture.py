# SPDX-License-Identifier: BSD-3-Clause
"""A picture of a page: one small class, one template, and a script if its figures need one.

The module is in the folder of its page, ``skidyn/report/_pages/<page>/<name>.py``, with its
template ``<name>.html.jinja`` and its script ``<name>.js``. It is not registered elsewhere: a page
is made of the pictures in its folder and in the folder ``every``, in the order of their ``place``.
"""

from __future__ import annotations

import pkgutil
from functools import cache
from importlib import import_module
from typing import Any, ClassVar

Summary = dict[str, Any]


class Canvas:
    """Data for the scripts of a page: ``figures``, and further ``numbers`` for a script."""

    def __init__(self) -> None:
        self.numbers: dict[str, Any] = {"figures": []}

    def figure(self, figure: dict[str, Any]) -> int:
        """Number by which a template refers to a figure; a figure shown twice is stored once.

        ``type`` is a kind of figure in ``static/figures.js``; the rest is its data.

        >>> canvas = Canvas()
        >>> [canvas.figure({"type": "bars", "values": [x]}) for x in (1.0, 2.0, 1.0)]
        [0, 1, 0]
        """
        figures: list[dict[str, Any]] = self.numbers["figures"]
        if figure not in figures:
            figures.append(figure)
        return figures.index(figure)


class Picture:
    """A part of a page: the data that it reads, and the variables of its template.

    Attributes
    ----------
    place : int
        Rank of the picture on its page.
    title : str, default=""
        Entry in the list of contents; none if empty.

    Examples
    --------
    >>> class Errors(Picture):
    ...     place, title = 25, "Errors"
    ...
    ...     def read(self, subject):
    ...         return subject.comparison.rmse()
    ...
    ...     def show(self, summary, canvas):
    ...         return {"figure": canvas.figure({"type": "bars", "values": summary["errors"]})}
    """

    place: ClassVar[int]
    title: ClassVar[str] = ""

    def read(self, subject: Any) -> Any:
        """Data of a diagnosis, comparison or fleet, for the summary under the module's name."""
        return None

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any] | None:
        """Variables of the template; None leaves the picture out."""
        return {}


@cache
def pictures(page: str) -> dict[str, Picture]:
    """Pictures of a page by their names, in the order of the page."""
    found = {}
    for folder in (page, "every"):
        package = import_module(f"skidyn.report._pages.{folder}")
        for entry in pkgutil.iter_modules(package.__path__):
            module = import_module(f"{package.__name__}.{entry.name}")
            own = (value for value in vars(module).values() if isinstance(value, type))
            found[entry.name] = next(
                kind()
                for kind in own
                if issubclass(kind, Picture) and kind.__module__ == module.__name__
            )
    return dict(sorted(found.items(), key=lambda item: item[1].place))


def read_all(page: str, subject: Any) -> Summary:
    """Data that every picture of a page reads of its subject, by the pictures' names."""
    return {name: picture.read(subject) for name, picture in pictures(page).items()}
