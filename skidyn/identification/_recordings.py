# SPDX-License-Identifier: BSD-3-Clause
"""Recordings are recognised by their motion, so that an effect stays with its recording.

An effect of single recordings (an offset of one run, a payload in some) refers to them by number.
In another log the same numbers are other recordings. A model therefore stores the positions of the
recordings of its effects, as one number per row, and recognises them under any number.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, Signals
from skidyn.effects import Term

#: Decimal places to which positions are rounded (rad or m), to allow for storage in a file.
PLACES = 5
#: A recording is recognised if this share of its different rows is.
KNOWN = 0.5

#: Number and rows of every stored recording.
Recordings = list[tuple[int, NDArray[np.uint64]]]


def named_recordings(terms: Iterable[Term]) -> set[int]:
    """Trajectories in the shapes of terms."""
    named: set[int] = set()
    for term in terms:
        named |= set(term.trajectories or ())
    return named


def remember(signals: Signals, terms: Iterable[Term]) -> Recordings:
    """Fingerprints of the recordings in the shapes of terms."""
    named = sorted(named_recordings(terms))
    return [(k, np.unique(_rows(signals.q[signals.trajectory == k]))) for k in named]


def recognise(signals: Signals, recordings: Recordings) -> Signals:
    """The same signals, of any log, with the recording numbers of the model.

    Other recordings get numbers that no effect uses.
    """
    labels = np.unique(signals.trajectory)
    unknown = min([0, *(k for k, _ in recordings), *labels.tolist()]) - 1
    renamed = np.empty(len(signals.trajectory), dtype=np.int64)
    for i, label in enumerate(labels):
        here = signals.trajectory == label
        rows = np.unique(_rows(signals.q[here]))
        shares = [(float(np.isin(rows, own).mean()), k == label, k) for k, own in recordings]
        share, _, number = max(shares, default=(0.0, False, 0))
        renamed[here] = number if share > KNOWN else unknown - i
    return signals.with_(trajectory=renamed)


def _rows(q: Array) -> NDArray[np.uint64]:
    """One number for every row of positions."""
    factors = np.random.default_rng(0).integers(1, 2**63, q.shape[1], dtype=np.uint64)
    whole = np.round(q * 10.0**PLACES).astype(np.int64).astype(np.uint64)
    return np.asarray((whole * factors).sum(axis=1, dtype=np.uint64))
