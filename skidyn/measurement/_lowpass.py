# SPDX-License-Identifier: BSD-3-Clause
"""First-order low passes: removal from a channel, and distinction from a delay."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._check import Check
from skidyn.measurement._fits import Fits
from skidyn.measurement._joint_fit import NEAR, JointFit
from skidyn.measurement._peak import climb, vertex
from skidyn.measurement._robust import robust_likelihood
from skidyn.measurement._suspicion import Suspicion, remedy_of

#: Time constants that are tried, in lags that a delay in its place has; steps of their logarithm
#: that are halved, and the least one.
TRIED, STEP, LEAST_STEP = (0.6, 0.8, 1.0, 1.3, 1.7, 2.2, 3.0), 0.1, 0.005


def suspect_lowpass(
    check: Check, what: str, column: str, constant: float, evidence: str, joints: Iterable[int] = ()
) -> Suspicion:
    """Suspicion that a channel has passed a low pass, with the remedy that removes it.

    Parameters
    ----------
    check : Check
        Check that reports it.
    what : str
        Text of the channel.
    column : str
        Its name in the remedy, such as ``"tau"`` or ``"q2"``.
    constant : float, s
        Time constant.
    evidence : str
        Evidence for it.
    joints : iterable of int, default=()
        Joints, from 0.
    """
    value = float(f"{constant:.3g}")
    return check.suspicion(
        f"{what} passed a low-pass filter of about {0.5 / np.pi / constant:.2g} Hz",
        evidence,
        "suspected",
        joints,
        remedy_of("lowpass", {column: value}),
    )


def without_lowpass(time: Array, values: Array, constant: float) -> Array:
    """Input of a first-order low pass from its output.

    Parameters
    ----------
    time : ndarray of shape (n_samples,), s
        Increasing stamps of one interval.
    values : ndarray of shape (n_samples,) or (n_samples, n_channels)
        Filtered values.
    constant : float, s
        Time constant.

    Returns
    -------
    ndarray of the shape of ``values``
        The first value is that of the output, because earlier values are unknown.
    """
    out = np.array(values, dtype=float)
    passed = 1 - np.exp(-np.diff(time) / constant)
    passed = passed.reshape(-1, *([1] * (out.ndim - 1)))
    out[1:] = values[:-1] + np.diff(values, axis=0) / passed
    return out


def summit(likelihood: Callable[[float], float], tried: Sequence[float]) -> tuple[float, float]:
    """Positive number with the largest likelihood, and this likelihood.

    Parameters
    ----------
    likelihood : callable
    tried : sequence of float
        Initial values.
    """
    _, log = max((likelihood(x), float(np.log(x))) for x in tried)
    log, best = climb(lambda log: likelihood(float(np.exp(log))), log, STEP, LEAST_STEP)
    return float(np.exp(log)), best


def lowpass_of_torque(fits: Fits, lag: float, late: Sequence[int]) -> tuple[float, float]:
    """Time constant of a low pass instead of a delay, and its log-likelihood gain over the delay.

    Bodies are fitted to the torque without the low pass. Their residual is filtered again, so that
    both hypotheses refer to the recorded torque.

    Parameters
    ----------
    fits : Fits
        Rows.
    lag : float, s
        Approximate lag of the torque.
    late : sequence of int
        Joints, from 0, whose torque is late.
    """
    together = JointFit(fits, late)
    source, clock = fits.recorded, fits.signals.clock
    steps = np.diff(clock)
    step = float(np.median(steps))
    parts = np.split(np.arange(len(clock)), np.flatnonzero(np.abs(steps / step - 1) > 0.5) + 1)

    from scipy.signal import lfilter  # its import takes half a second, and few logs need it

    def unfiltered(constant: float) -> Array:
        torque = np.empty_like(source.torque)
        for rows in source.segments:
            torque[rows] = without_lowpass(source.clock[rows], source.torque[rows], constant)
        return torque

    def filtered(constant: float) -> float:
        samples = fits.torque.copy()
        samples[:, late] = unfiltered(constant)[source.picked][:, late]
        left = together.left(samples, together.fit(samples))
        passed = 1 - np.exp(-step / constant)
        for column, k in enumerate(together.joints):
            for part in parts if k in late else ():
                start = [(1 - passed) * left[part[0], column]]
                left[part, column], _ = lfilter(
                    [passed], [1, passed - 1], left[part, column], zi=start
                )
        rest = fits.average(left)
        return sum(robust_likelihood(rest[use, column]) for column, use in enumerate(together.rows))

    def still_late(constant: float) -> float:
        """Lag of the torque without the low pass, by a parabola."""
        other = replace(fits, recorded=replace(source, torque=unfiltered(constant)))
        left, middle, right = (
            together.likelihood(other.torque_at(shift)) for shift in (-NEAR, 0.0, NEAR)
        )
        return float(np.clip(vertex(left, middle, right) or 0.0, -1, 1)) * NEAR

    constant, best = summit(filtered, [share * lag for share in TRIED])
    _, other = summit(together.likelihood_at, [share * lag for share in (0.8, 1.0, 1.2)])
    # the delay of slow motion by a low pass is known better than its form
    return constant + still_late(constant), best - other
