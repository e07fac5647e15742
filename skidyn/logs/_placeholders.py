# SPDX-License-Identifier: BSD-3-Clause
"""Remedy for values that stand for failed reads: they become missing values."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._exceptions import LogError

if TYPE_CHECKING:
    import pandas as pd

#: ``9999`` for all signals, several of them, or one or several by quantity or column.
Placeholder = float | Sequence[float] | Mapping[str, float | Sequence[float]]
_SIGNAL = re.compile(r"(q|dq|ddq|tau|temp|cmd|i)\d+")
#: Note about a placeholder that is nowhere.
_NOWHERE = re.compile(r"placeholder: 0 of \d+ rows hold (\S+)=(\S+),")


class Placeholders:
    """Values that stand for failed reads, and in how many rows of a file they were found.

    A value is compared with the numbers of the file, and where it is none of these, with those in
    SI units after all other changes of columns, which the checks state.
    """

    def __init__(self, asked: Placeholder | None) -> None:
        by_name: Mapping[str, Any] = asked if isinstance(asked, Mapping) else {"all": asked}
        self._counts: dict[tuple[str, float], tuple[int, int]] = {}
        for name, values in by_name.items() if asked is not None else ():
            for value in values if isinstance(values, (list, tuple, np.ndarray)) else [values]:
                good = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
                if not good or not np.isfinite(value):
                    raise LogError(
                        f"placeholder: {name} has {value!r}; expected a number, such as 9999 or "
                        "q=-1."
                    )
                self._counts[str(name), float(value)] = 0, 0

    def __bool__(self) -> bool:
        return bool(self._counts)

    def remove(self, table: pd.DataFrame) -> pd.DataFrame:
        """The table with missing values in the place of these values."""
        return self._without(table, list(self._counts))

    def remove_rest(self, table: pd.DataFrame) -> pd.DataFrame:
        """The same for values that were not in the file; a LogError names unknown columns."""
        for name, _ in self._counts:
            if not _columns(name, table):
                raise LogError(
                    f"placeholder: the log has no {name}; it has "
                    f"{', '.join(map(str, table.columns))}, and all means all its signals."
                )
        rest = [key for key, (rows, _) in self._counts.items() if not rows]
        self._counts.update(dict.fromkeys(rest, (0, 0)))
        return self._without(table, rest)

    def _without(self, table: pd.DataFrame, keys: Sequence[tuple[str, float]]) -> pd.DataFrame:
        masks = {}
        for name, value in keys:
            columns = _columns(name, table)
            if not columns:  # in another file of the recording
                continue
            held = table[columns].to_numpy(dtype=float) == value
            found, total = self._counts[name, value]
            self._counts[name, value] = found + int(held.any(axis=1).sum()), total + len(table)
            masks[name, value] = columns, held
        if not any(held.any() for _, held in masks.values()):
            return table
        table = table.copy()
        for columns, held in masks.values():
            table[columns] = table[columns].astype(float).mask(held)
        return table

    def notes(self) -> list[str]:
        """What was found, as sentences."""
        return [
            f"placeholder: {found} of {total} rows hold {name}={repr(value).removesuffix('.0')}, "
            "which became a missing value"
            for (name, value), (found, total) in self._counts.items()
        ]


def refuse_absent(notes: Sequence[str]) -> None:
    """Raise a LogError if a placeholder is in none of the files, by the notes on all of them."""
    for note in notes:
        if hit := _NOWHERE.match(note):
            where = "the signals" if hit[1] == "all" else hit[1]
            raise LogError(
                f"placeholder: no value of {where} equals {hit[2]}; values are compared exactly, "
                "as in the file or in SI units as stated by skidyn check."
            )


def _columns(name: str, table: pd.DataFrame) -> list[str]:
    """Columns of signals with a name, of a quantity, or all."""
    signals = [(str(c), hit[1]) for c in table.columns if (hit := _SIGNAL.fullmatch(str(c)))]
    return [column for column, quantity in signals if name in ("all", quantity, column)]
