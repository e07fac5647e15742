# SPDX-License-Identifier: BSD-3-Clause
"""Moments of a log at which an effect may begin."""

from __future__ import annotations

import numpy as np

from skidyn._signals import Array, Signals


def starts(signals: Signals) -> Array:
    """Times at which its recordings begin, except the first, in s and in the order of time.

    Parameters
    ----------
    signals : Signals
        Motion.

    Returns
    -------
    ndarray of shape (n_recordings - 1,)
        Empty if the clock begins anew with every recording, so that it does not order them.
    """
    clock = signals.clock
    spans = sorted((float(clock[own].min()), float(clock[own].max())) for own in signals.segments)
    begun = np.array([first for first, _ in spans])
    ended = np.array([last for _, last in spans])
    return begun[1:] if np.all(begun[1:] > ended[:-1]) else np.zeros(0)


def moments(signals: Signals, count: int) -> list[float]:
    """Moments spread over the samples of a log; where a recording begins close to one, then.

    Parameters
    ----------
    signals : Signals
        Motion.
    count : int
        Number of moments, from which others are found by a search.

    Returns
    -------
    list of float
        Times in s.
    """
    order = np.sort(signals.clock)
    places = np.linspace(0, len(order), count + 2)[1:-1]
    begun = np.searchsorted(order, starts(signals))
    if len(begun):
        nearest = begun[np.abs(begun[:, None] - places).argmin(axis=0)]
        near = np.abs(nearest - places) <= 0.5 * len(order) / (count + 1)
        places = np.where(near, nearest, places)
    return [float(t) for t in order[np.unique(places.astype(int))]]
