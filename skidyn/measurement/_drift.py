# SPDX-License-Identifier: BSD-3-Clause
"""Growing lag of torque whose clock runs at a different rate than that of the motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._delay import Delay
from skidyn.measurement._fits import Fits
from skidyn.measurement._joint_fit import NEAR, JointFit
from skidyn.measurement._peak import peak
from skidyn.measurement._robust import gains_of

#: How often the lag in the middle of recordings and its growth are refined in turn: they hardly
#: influence each other.
TURNS = 2
#: Log-likelihood that a growing lag must gain over a constant one, and over one that goes on
#: growing from recording to recording.
LEAST = 15.0


@dataclass(frozen=True)
class Drift:
    """Lag of the torque that grows with the time since the beginning of a recording.

    Attributes
    ----------
    lag : float, s
        At the beginning of every recording; positive if torque is late.
    growth : float, s/s
        Its change with time.
    gains : tuple of float
        Log-likelihood gain over a constant lag, by joint.
    is_of_log : bool
        Whether it grows with the time of the log instead, as the lag of a clock that is set only
        once, before the first of several recordings; ``lag`` is then that in their middle.
    """

    lag: float
    growth: float
    gains: tuple[float, ...]
    is_of_log: bool

    @property
    def gain(self) -> float:
        """Log-likelihood gain of all joints."""
        return sum(self.gains)

    @property
    def option(self) -> str:
        """As in the option ``--late``."""
        return f"{self.lag:g}{self.growth:+g}*t"


def find_drift(fits: Fits, found: Delay) -> Drift | None:
    """Growing lag with which all joints together are explained best.

    None if a constant lag explains the torque as well.

    Parameters
    ----------
    fits : Fits
        Rows.
    found : Delay
        Lags in the halves of the recordings.
    """
    together = JointFit(fits, range(fits.n_joints))
    since = since_beginning(fits)
    longest = float(since.max())
    growth = 2 * (found.late - found.early) / longest
    constant, lag = _at_peak(together, found.common, NEAR, lambda lag: lag)
    time = since - longest / 2
    middle, growth, own = _refined(together, time, lag, growth)
    clock, is_of_log = fits.signals.clock, False
    if np.ptp(clock - since) > longest:  # the recordings follow each other on one clock
        of_log = _refined(together, clock - clock.mean(), lag, growth)
        if of_log[2] + LEAST > own:
            time, is_of_log = clock - clock.mean(), True
            middle, growth, own = of_log
    if own - constant < LEAST:
        return None
    there = together.fit_at(middle + growth * time)
    gains = tuple(gains_of(together.fit_at(lag), there))
    begin = middle if is_of_log else middle - growth * longest / 2
    return Drift(float(f"{begin:.5f}"), float(f"{growth:.4g}"), gains, is_of_log)


def since_beginning(fits: Fits) -> Array:
    """Time of every sample since the beginning of its recording, s."""
    source, number = fits.recorded, fits.signals.trajectory
    begin: dict[int, float] = {}
    since = np.empty(len(source.picked))
    for rows in source.segments:
        own = (source.picked >= rows.start) & (source.picked < rows.stop)
        if own.any():
            run = int(number[own][0])
            begin.setdefault(run, float(source.clock[rows.start]))
            since[own] = source.clock[source.picked[own]] - begin[run]
    return since


def _refined(
    together: JointFit, since: Array, lag: float, growth: float
) -> tuple[float, float, float]:
    """Lag at time zero and growth of the largest likelihood, and that likelihood."""
    reach, best = float(np.abs(since).max()), 0.0

    def of_lag(value: float) -> Array:
        return np.asarray(value + growth * since)

    def of_growth(value: float) -> Array:
        return np.asarray(lag + value * since)

    for _ in range(TURNS):
        _, lag = _at_peak(together, lag, NEAR, of_lag)
        best, growth = _at_peak(together, growth, NEAR / reach, of_growth)
    return lag, growth, best


def _at_peak(
    together: JointFit, start: float, near: float, lag_of: Callable[[float], float | Array]
) -> tuple[float, float]:
    """Largest likelihood over one number that determines the lag, and that number."""

    def likelihood(value: float) -> float:
        return together.likelihood_at(lag_of(value))

    value = peak(likelihood, start, near)
    return likelihood(value), value
