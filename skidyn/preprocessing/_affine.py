# SPDX-License-Identifier: BSD-3-Clause
"""Affine scaling of inputs and outputs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def scaling_of(values: Array, kind: str) -> tuple[Array, Array]:
    """Offset and scale of each column: to zero mean and unit variance, or to the range 0 to 1.

    ``(values - offset) / scale`` is scaled; constant columns have scale 1.
    """
    if kind == "minmax":
        offset, scale = values.min(axis=0), np.ptp(values, axis=0)
    else:
        offset, scale = values.mean(axis=0), values.std(axis=0)
    # a column that is constant up to rounding must not be enlarged
    floor = 10 * np.finfo(np.float64).eps * np.maximum(np.abs(offset), np.abs(values).max(axis=0))
    return offset, np.where(scale > floor, scale, 1.0)
