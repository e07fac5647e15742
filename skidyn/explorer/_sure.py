# SPDX-License-Identifier: BSD-3-Clause
"""Confidence in an added effect, from the other effects ranked for the same joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from skidyn._text import inside
from skidyn.diagnosis import confidence

if TYPE_CHECKING:
    from skidyn.explorer._session import RankedEffect

#: A rival removes nearly as much error if its gain is smaller by less than this share.
NEAR = 0.1


@dataclass(frozen=True)
class Margin:
    """Difference between the gains of an added effect and the best other effect, the ``rival``.

    The share of the gain is negative if the other effect removes more error.
    """

    share: float = 1.0
    rival: str = ""


def margin(kind: str, ranked: Sequence[RankedEffect]) -> Margin:
    """Margin of an effect among those that would have helped the same joint before it was added."""
    gains = {e.kind: -np.log1p(-min(e.drop, 1 - 1e-12)) for e in ranked}
    titles = {e.kind: e.title for e in ranked}
    others = [other for other in gains if other != kind]
    if not others:
        return Margin()
    rival = max(others, key=gains.__getitem__)
    own = gains.get(kind, 0.0)
    return Margin(float(1 - gains[rival] / own) if own > 0 else -1.0, titles[rival])


def sure_told(
    margin: Margin,
    inflation: float,
    removed: float,
    whole_recordings: bool,
) -> str:
    """Confidence in an added effect, in a few words; see :func:`skidyn.diagnosis.confidence`.

    >>> sure_told(Margin(0.8, "Offset"), 1.0, 0.5, True)
    'confidence 98%'
    >>> sure_told(Margin(0.8, "Offset"), 12.0, 0.5, True)  # much error remains
    'confidence 91%'
    >>> sure_told(Margin(0.01, "Offset"), 1.0, 0.5, True)
    'confidence 95%; offset removes nearly as much of the error'
    >>> sure_told(Margin(-0.3, "Spring"), 1.0, 0.5, True)
    'low confidence: spring removes more of the error'
    """
    if margin.share < 0:
        return f"low confidence: {inside(margin.rival)} removes more of the error"
    share = confidence(
        margin.share,
        inflation,
        removed,
        whole_recordings=whole_recordings,
    )
    near = margin.share < NEAR and margin.rival
    also = f"; {inside(margin.rival)} removes nearly as much of the error" if near else ""
    return f"confidence {share:.0%}{also}"
