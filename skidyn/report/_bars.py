# SPDX-License-Identifier: BSD-3-Clause
"""Scale of the bars on the first screen: errors relative to the noise, before and after."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite, log10

#: Above this many times the noise the scale is logarithmic.
LINEAR = 12.0
#: Least distance of ticks as a share of the bar.
APART = 0.2
#: Where a logarithmic scale begins.
LOWEST = 0.5


@dataclass(frozen=True)
class Scale:
    """Positions of errors over noise along a bar; ``largest`` is the error at its end."""

    largest: float

    @property
    def ticks(self) -> list[int]:
        """Whole multiples of the noise that are written below the bars."""
        if self.largest > LINEAR:
            return [10**k for k in range(int(log10(self.largest)) + 1)]
        step = next(s for s in (1, 2, 3, 5) if s >= APART * self.largest)
        return [1, *(k for k in range(1 + step, int(self.largest) + 1) if k % step == 0)]

    def place(self, ratio: float | None) -> float:
        """Length of a bar in per cent; zero if there is no number."""
        if ratio is None or not isfinite(ratio) or ratio <= 0:
            return 0.0
        if self.largest > LINEAR:
            share = log10(max(ratio / LOWEST, 1.0)) / log10(self.largest / LOWEST)
        else:
            share = ratio / self.largest
        return round(100 * min(share, 1.0), 1)


def scale_of(ratios: Iterable[float | None]) -> Scale:
    """A scale that includes all errors over noise, and the noise.

    >>> scale = scale_of([4.0, 1.0, None])
    >>> scale.ticks, scale.place(4.0), scale.place(1.0), scale.place(None)
    ([1, 2, 3, 4], 98.0, 24.5, 0.0)
    >>> scale = scale_of([300.0, 1.0])
    >>> scale.ticks, scale.place(1.0), scale.place(10.0), scale.place(100.0)
    ([1, 10, 100], 10.8, 46.7, 82.6)
    """
    known = [r for r in ratios if r is not None and isfinite(r)]
    return Scale(max([1.5, *known]) * 1.02)
