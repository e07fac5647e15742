# SPDX-License-Identifier: BSD-3-Clause
"""Small changes of an XML file without a change of any other byte."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from skidyn._exceptions import SkidynError

#: Size of a description, bytes, beyond which it is refused.
LARGEST = 64 * 2**20


@dataclass
class Element:
    """An element, and its position in the file in bytes: of the start tag, and its own end."""

    tag: str
    attributes: dict[str, str]
    start: int
    head: int
    end: int = -1
    children: list[Element] = field(default_factory=list)

    def walk(self) -> Iterator[Element]:
        """The element and all below it, in the order of the file."""
        yield self
        for child in self.children:
            yield from child.walk()

    def find(self, tag: str) -> Element | None:
        """The first child of a tag."""
        return next((child for child in self.children if child.tag == tag), None)


class Edits:
    """A file, its elements, and the changes to be made."""

    def __init__(self, source: str | os.PathLike[str]) -> None:
        self.path = Path(source)
        if self.path.stat().st_size > LARGEST:
            raise SkidynError(f"{self.path} is larger than {LARGEST >> 20} MiB")
        self.data = self.path.read_bytes()
        self._changes: list[tuple[int, int, bytes]] = []
        if b"<!DOCTYPE" in self.data or b"<!ENTITY" in self.data:
            raise SkidynError(f"{self.path} declares a document type; remove it")
        self.root = self._parsed()

    def _parsed(self) -> Element:
        top = Element("", {}, 0, 0)
        stack = [top]
        parser = expat.ParserCreate("utf-8")

        def start(tag: str, attributes: dict[str, str]) -> None:
            at = parser.CurrentByteIndex
            element = Element(tag, attributes, at, self._end_of_tag(at))
            stack[-1].children.append(element)
            stack.append(element)

        def end(tag: str) -> None:
            element = stack.pop()
            empty = self.data[element.head - 2 : element.head] == b"/>"
            at = parser.CurrentByteIndex
            element.end = element.head if empty else self.data.index(b">", at) + 1

        parser.StartElementHandler, parser.EndElementHandler = start, end
        try:
            parser.Parse(self.data, True)
        except (expat.ExpatError, UnicodeDecodeError) as error:
            raise SkidynError(f"{self.path} is not XML in UTF-8: {error}") from None
        return top.children[0]

    def _end_of_tag(self, at: int) -> int:
        match = re.compile(rb"""<(?:[^'">]|"[^"]*"|'[^']*')*>""").match(self.data, at)
        if match is None:
            raise SkidynError(f"{self.path}: the tag at byte {at} has no end")
        return match.end()

    def set_attributes(self, element: Element, values: dict[str, str]) -> None:
        """Change attributes of an element, or add them after existing ones."""
        head = self.data[element.start : element.head]
        added = b""
        for name, value in values.items():
            found = re.compile(rb"""(\s%s\s*=\s*)("[^"]*"|'[^']*')""" % name.encode()).search(head)
            new = f'"{value}"'.encode()
            if found is None:
                added += f' {name}="{value}"'.encode()
            else:
                at = element.start + found.start(2)
                self._changes.append((at, element.start + found.end(2), new))
        if added:
            close = b"/>" if head.endswith(b"/>") else b">"
            at = element.start + len(head[: -len(close)].rstrip())
            self._changes.append((at, at, added))

    def replace(self, element: Element, text: str) -> None:
        """Replace an element by a text."""
        self._changes.append((element.start, element.end, text.encode()))

    def insert_first(self, element: Element, text: str) -> None:
        """Insert a child before all others, on a separate line with their indentation."""
        head = self.data[element.start : element.head]
        indent = self._indentation(element)
        first = element.children[0] if element.children else None
        deeper = self._indentation(first) if first is not None else indent + b"  "
        if head.endswith(b"/>"):
            at = element.start + len(head[:-2].rstrip())
            tail = b">\n" + deeper + text.encode() + b"\n" + indent
            self._changes.append((at, element.head, tail + f"</{element.tag}>".encode()))
        else:
            new = b"\n" + deeper + text.encode()
            self._changes.append((element.head, element.head, new))

    def insert_after(self, element: Element, text: str) -> None:
        """Insert a sibling after an element, on a separate line with its indentation."""
        indent = self._indentation(element)
        new = (b"\n" + indent if indent else b"") + text.encode()
        self._changes.append((element.end, element.end, new))

    def _indentation(self, element: Element) -> bytes:
        line = self.data.rfind(b"\n", 0, element.start) + 1
        before = self.data[line : element.start]
        return before if not before.strip() else b""

    def text(self) -> bytes:
        """The file with all changes."""
        result, at = [], 0
        for start, end, new in sorted(self._changes, key=lambda change: change[:2]):
            result += [self.data[at:start], new]
            at = end
        return b"".join([*result, self.data[at:]])
