# SPDX-License-Identifier: BSD-3-Clause
"""Thinning of long signals for a screen, keeping every peak."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray


def rows_with_peaks(
    signals: Sequence[ArrayLike], segments: Sequence[slice], n_buckets: int
) -> list[NDArray[np.intp]]:
    """Rows to draw, by segment: the extremes of every signal in every bucket, and the ends.

    The signals are drawn over the same time. There are some ``n_buckets`` for all rows together,
    and none crosses the border of a segment; if rows are few, all of them are returned.
    """
    arrays = [np.asarray(signal, dtype=float) for signal in signals]
    total = sum(s.stop - s.start for s in segments)
    width = max(1, total // max(1, n_buckets))
    return [_segment_rows(arrays, segment, width) for segment in segments]


def _segment_rows(
    arrays: list[NDArray[np.float64]], segment: slice, width: int
) -> NDArray[np.intp]:
    length = segment.stop - segment.start
    if width <= 2 * len(arrays):  # nothing to gain
        return np.arange(segment.start, segment.stop)
    whole = length // width * width
    keep = [np.array([0, length - 1])]
    starts = np.arange(0, whole, width)
    for array in arrays:
        values = array[segment]
        blocks = values[:whole].reshape(-1, width)
        keep += [starts + blocks.argmin(axis=1), starts + blocks.argmax(axis=1)]
        if whole < length:
            rest = values[whole:]
            keep.append(whole + np.array([rest.argmin(), rest.argmax()]))
    rows: NDArray[np.intp] = segment.start + np.unique(np.concatenate(keep))
    return rows
