# SPDX-License-Identifier: BSD-3-Clause
"""Text that fits the terminal: output and ``--help``."""

from __future__ import annotations

import argparse
import re
import shutil
import textwrap
from itertools import groupby
from typing import Any, TextIO

#: Characters that move the cursor or change the terminal; names in files may contain them.
_OBEYED = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


class FittingStream:
    """A terminal stream whose long lines are broken between words.

    Programs that read the output get unchanged lines.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._rest = stream, ""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write complete lines, and keep the rest."""
        *lines, self._rest = (self._rest + text).split("\n")
        width = shutil.get_terminal_size().columns
        for line in lines:
            self._stream.write(fit(line, width) + "\n")
        return len(text)

    def flush(self) -> None:
        """Write the kept rest."""
        self._stream.write(self._rest)
        self._rest = ""
        self._stream.flush()


def fit(line: str, width: int, end: str = "") -> str:
    """A line broken between words to fit a width, without control characters.

    Further lines begin under the last column of a table that is in the left half, or else four
    spaces further than the first. ``end`` is at the end of every line except the last.

    >>> print(fit("  one two three four five six", 24))
      one two three four
          five six
    >>> print(fit("0.5   one two three four five", 20))
    0.5   one two three
          four five
    >>> print(fit("written: /a/path/to/be/copied.json", 20))
    written:
        /a/path/to/be/copied.json
    """
    line = _OBEYED.sub(lambda hit: f"\\x{ord(hit[0]):02x}", line)
    if len(line) <= width:
        return line
    lead = line[: len(line) - len(line.lstrip())]
    columns = [m.end() for m in re.finditer(r"(?<=\S) {2,}(?=\S)", line)]
    hang = columns[-1] if columns and columns[-1] <= width // 2 else len(lead) + 4
    parts = textwrap.wrap(
        line.strip(),
        max(width - len(end), 20),
        initial_indent=lead,
        subsequent_indent=" " * hang,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return f"{end}\n".join(parts)


class TeachingFormatter(argparse.RawDescriptionHelpFormatter):
    """Help formatter that fits paragraphs to the terminal and keeps indented examples."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        lines = []
        for example, group in groupby(text.splitlines(), lambda x: x.startswith("  ") or not x):
            if example:
                lines += [_example(line, width) for line in group]
            else:
                lines.append(textwrap.fill(" ".join(group), width))
        return "\n".join(lines)


def _example(line: str, width: int) -> str:
    """A command that can be copied; its description follows below if it does not fit."""
    if len(line) <= width:
        return line
    command, *said = re.split(r"(?<=\S) {2,}(?=\S)", line, maxsplit=1)
    return "\n".join([fit(command, width, end=" \\"), *(fit(" " * 6 + s, width) for s in said)])
