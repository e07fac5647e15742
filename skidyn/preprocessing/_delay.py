# SPDX-License-Identifier: BSD-3-Clause
"""Estimate and remove the delay of one channel relative to another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import signal
from scipy.interpolate import Akima1DInterpolator

from skidyn._signals import find_segments

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

#: Number of blocks of rows that are left out in turn for the standard error.
BLOCKS = 10


@dataclass(frozen=True)
class DelayEstimate:
    """Delay of one channel relative to another.

    Parameters
    ----------
    delay : float, s
        Positive if the channel is late.
    standard_error : float, s
        Jackknife estimate, with one tenth of the log left out at a time.
    correlation : float
        Correlation of the detrended signals after removing the delay.

    Examples
    --------
    >>> from skidyn.preprocessing import DelayEstimate
    >>> DelayEstimate(0.008, 0.001, 0.99).delay
    0.008
    """

    delay: float
    standard_error: float
    correlation: float


def estimate_delay(
    reference: ArrayLike,
    channel: ArrayLike,
    *,
    time: ArrayLike | None = None,
    rate: float | None = None,
    trajectory: ArrayLike | None = None,
    largest: float = 0.1,
) -> DelayEstimate:
    """Time by which a channel lags a reference of the same shape.

    Both must follow the same quantity up to scale and offset: the recorded velocity and the
    differentiated position, the torque of two sensors, a motor current and its torque. The delay is
    where the cross-correlation of their differences is largest, between samples by a parabola. For
    torque against motion, whose shapes differ, see the delay that :func:`skidyn.logs.check_log`
    reports.

    Parameters
    ----------
    reference, channel : array-like of shape (n_samples,)
        The two signals, sampled at the same rows.
    time : array-like of shape (n_samples,), s, optional
        Clock; or give ``rate``.
    rate : float, Hz, optional
        Sampling rate.
    trajectory : array-like of shape (n_samples,), optional
        Trajectory of each row; nothing is compared across their borders.
    largest : float, s, default=0.1
        Largest delay in the search, in both directions.

    Returns
    -------
    DelayEstimate
        Delay, its standard error and the remaining correlation.

    Raises
    ------
    ValueError
        There is no clock, signals differ in length, the log is too short, a signal is constant, or
        the correlation has no maximum within ``largest``.

    References
    ----------
    .. [1] G. Jacovitti, G. Scarano, "Discrete Time Techniques for Time Delay Estimation", IEEE
       Transactions on Signal Processing 41(2), 1993.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.preprocessing import estimate_delay
    >>> t = np.arange(2000) * 0.002
    >>> def motion(t):
    ...     return np.sin(3 * t) + 0.5 * np.sin(11 * t)
    >>> round(estimate_delay(motion(t), 2 * motion(t - 0.0125), time=t).delay, 4)
    0.0125
    """
    a, b = np.asarray(reference, dtype=float), np.asarray(channel, dtype=float)
    if a.ndim != 1 or a.shape != b.shape:
        raise ValueError(
            f"reference and channel must be columns of equal shape; got {a.shape}, {b.shape}."
        )
    clock, step = _clock(len(a), time, rate)
    runs = np.zeros(len(a), dtype=int) if trajectory is None else np.asarray(trajectory)
    reach = int(np.ceil(largest / step)) + 1
    products = []
    for rows in find_segments(runs, clock):
        if rows.stop - rows.start < 4 * reach + 30:
            continue
        grid = np.arange(clock[rows.start], clock[rows.stop - 1], step)
        x, y = (_differences(np.interp(grid, clock[rows], s[rows])) for s in (a, b))
        products += _block_products(x, y, reach)
    if not products:
        raise ValueError(
            f"no continuous part of the log is long enough for delays up to {largest} s; lower "
            "largest."
        )
    table = np.array(products)  # (blocks, 3, shifts): products and both energies
    total = table.sum(axis=0)
    if (total[1:] <= 0).any():
        raise ValueError("a constant signal has no delay; choose a stretch in which it moves.")
    best, correlation = _peak(total)
    if abs(best) >= reach - 1:
        raise ValueError(
            f"the correlation is largest at the edge of {largest} s: raise largest, or check "
            "whether both signals measure the same quantity."
        )
    groups = [table[k::BLOCKS].sum(axis=0) for k in range(min(BLOCKS, len(table)))]
    left = np.array([_peak(total - group)[0] for group in groups]) if len(groups) > 1 else None
    error = np.nan
    if left is not None:
        error = float(np.sqrt((len(left) - 1) * np.mean((left - left.mean()) ** 2)) * step)
    return DelayEstimate(float(best * step), error, float(correlation))


def _clock(n: int, time: ArrayLike | None, rate: float | None) -> tuple[Array, float]:
    if time is None and rate is None:
        raise ValueError("give time (s) or rate (Hz).")
    if time is None:
        assert rate is not None
        return np.arange(n) / rate, 1 / rate
    clock = np.asarray(time, dtype=float)
    steps = np.diff(clock)
    return clock, float(np.median(steps[steps > 0]))


def _differences(values: Array) -> Array:
    """Differences, which have no offset or slow drift, smoothed over five samples."""
    return np.asarray(signal.savgol_filter(values, 5, 2, deriv=1))


def _block_products(x: Array, y: Array, reach: int) -> list[Array]:
    """Per block and shift: sum of ``x(t) y(t + shift)``, and both energies."""
    inner = np.arange(reach, len(x) - reach)
    shifts = np.arange(-reach, reach + 1)
    blocks = []
    for rows in np.array_split(inner, max(1, min(BLOCKS, len(inner) // 20))):
        shifted = y[rows + shifts[:, None]]
        own = np.full(len(shifts), x[rows] @ x[rows])
        blocks.append(np.array([shifted @ x[rows], own, (shifted**2).sum(axis=1)]))
    return blocks


def _peak(sums: Array) -> tuple[float, float]:
    """Shift in samples of the largest correlation (of either sign), and that correlation."""
    values = sums[0] / np.sqrt(sums[1] * sums[2])
    k = int(np.argmax(np.abs(values)))
    reach = (len(values) - 1) // 2
    if k in (0, len(values) - 1):
        return float(k - reach), float(values[k])
    left, middle, right = values[k - 1 : k + 2]
    bend = left - 2 * middle + right
    return float(k - reach + 0.5 * (left - right) / bend), float(values[k])


def advance_channels(
    frame: pd.DataFrame, delays: Mapping[str, float | tuple[float, float]]
) -> pd.DataFrame:
    """Remove delays from a log.

    Parameters
    ----------
    frame : DataFrame
        A log with ``time`` (s) and, for several trajectories, ``trajectory``.
    delays : mapping of str to float, s, or (float, float), s and s/s
        Delay of a column (``"tau3"``) or of a quantity (``"tau"``: all its joints); positive if it
        is late. Two numbers are the delay at the beginning of every trajectory and its growth, for
        a clock that runs at a different rate.

    Returns
    -------
    DataFrame
        The log with those columns read ``delay`` later, by Akima's interpolation. The rows at the
        ends of each segment for which there is no later (or earlier) sample are left out.

    Raises
    ------
    ValueError
        A column does not exist, a delay is not finite, or no row is left.

    Examples
    --------
    >>> import pandas as pd
    >>> from skidyn.preprocessing import advance_channels
    >>> log = pd.DataFrame({"time": [0.0, 1, 2, 3], "q1": [0.0, 1, 2, 3], "tau1": [9.0, 0, 1, 2]})
    >>> advance_channels(log, {"tau": 1.0})["tau1"].tolist()
    [0.0, 1.0, 2.0]
    >>> advance_channels(log, {"q": (0.0, 0.5)})["q1"].tolist()
    [0.0, 1.5, 3.0]
    """
    shifts: dict[str, tuple[float, float]] = {}
    for name, delay in delays.items():
        joints = [c for c in frame.columns if str(c).rstrip("0123456789") == name != c]
        if name not in frame.columns and not joints:
            raise ValueError(f"the log has no {name}; it has {', '.join(map(str, frame.columns))}.")
        lag, growth = delay if isinstance(delay, (tuple, list)) else (delay, 0.0)
        both = float(lag), float(growth)
        if not np.isfinite(both).all():
            raise ValueError(f"the delay of {name} is {delay!r}; a finite number of s is expected.")
        shifts |= dict.fromkeys([name] if name in frame.columns else joints, both)
    time = frame["time"].to_numpy(dtype=float)
    runs: Any = frame["trajectory"].to_numpy() if "trajectory" in frame else np.zeros(len(frame))
    columns = {name: frame[name].to_numpy(dtype=float, copy=True) for name in shifts}
    keep = np.ones(len(frame), dtype=bool)
    begin: dict[Any, float] = {}  # of a trajectory, which may have several segments
    for rows in find_segments(runs, time):
        own = time[rows]
        since = own - begin.setdefault(runs[rows.start], own[0])
        for name, (lag, growth) in shifts.items():
            later = own + lag + growth * since
            columns[name][rows] = _read_at(own, columns[name][rows], later)
            keep[rows] &= (later >= own[0]) & (later <= own[-1])
    if not keep.any():
        told = {name: lag for name, (lag, _) in shifts.items()}
        raise ValueError(f"no recording is longer than the delays {told} in s, so no row is left.")
    return frame.assign(**columns)[keep].reset_index(drop=True)


def _read_at(time: np.ndarray, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Values at other times; linear interpolation would reduce fast peaks."""
    if len(time) < 3 or np.any(np.diff(time) <= 0):
        return np.asarray(np.interp(wanted, time, values))
    inside = np.clip(wanted, time[0], time[-1])
    return np.asarray(Akima1DInterpolator(time, values, method="makima")(inside))
