# SPDX-License-Identifier: BSD-3-Clause
"""Checks of the clock: jittering stamps, repeated or interpolated rows, gaps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skidyn._repeated import REPEATED, moves_by_steps, repeated_rows, stale_rows
from skidyn._signals import Array, Signals, find_segments
from skidyn.measurement._arrival import rows_after_false_gaps, without_false_gaps
from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._suspicion import Suspicion, remedy_of, resample_to

#: Stamps closer to a regular clock than this share of a step do not jitter.
REGULAR = 1e-3
#: Half width in samples of the polynomial that predicts a position from its neighbours.
NEIGHBOURS = np.array([-2, -1, 1, 2])
#: Least rows of an interval, and least rows away from repetitions; with fewer, all rows are used.
SHORTEST, FRESH = 8, 200
#: Twice the log-likelihood ratio from which jitter is suspected, and is certain.
TOLD, CERTAIN = 20.0, 60.0
#: Steps by which stamps may be off a clock that is still regular.
WANDERING = 1.0
#: Log-likelihood gain of the torque by even steps from which jitter is harmful; error of stamps, as
#: a share of a step, that is harmful if there is no robot to test it.
HARM, OFF = 15.0, 0.02
#: How many times as closely positions must follow from their neighbours with even steps for stamps
#: without influence on the torque to be suspected.
CLOSER = 1.1
#: Share of long steps from which stamps may be rounded, how many times as many steps too long as
#: too short there may be, and largest distance of rounded stamps from even ones, in steps; lost
#: rows make the distance larger.
MISSING, TWICE, ROUNDED = 0.05, 2.0, 1.5
#: Share of rows that lie on a line between their neighbours.
ON_A_LINE = 0.3
#: Rounding error of numbers of seven digits, relative to the largest; how many times this a bend is
#: at least, but for some rows, as a share of those on a line, if rows were interpolated.
FEW_DIGITS, CLEARLY, NOT_BENT = 2e-6, 10.0, 1.15
#: How near the share of the other rows is to one in a whole number to be that.
NEARLY = 0.1
#: Share of rows with the stamp of the previous row, although joints moved, from which the stamps
#: are too coarse: without these rows, as many steps would miss rows as are reported.
SAME = 0.005
#: Share of repeated rows from which accelerations, and with them findings, are wrong.
MANY = 0.2


def regular_clock(time: Array, trajectory: NDArray[np.int64], q: Array | None = None) -> Array:
    """Time of every row if the samples were taken at even steps.

    Rows are numbered by the recorded time if it is unambiguous, so that missing rows stay missing,
    and consecutively if stamps jitter by more than half a step, or if they were rounded, that is,
    stay within a step of even ones although many steps are twice as long as others. The straight
    line through times over numbers is the clock.

    Parameters
    ----------
    time : ndarray of shape (n_samples,), s
        Recorded clock; coarse stamps may repeat.
    trajectory : ndarray of shape (n_samples,)
        Trajectory of every row; gaps in time are kept.
    q : ndarray of shape (n_samples, n_joints), rad or m, optional
        Recorded positions, with which gaps are closed across which joints move no further than
        from any row to the next.

    Returns
    -------
    ndarray of shape (n_samples,), s
        Even steps within every part without a gap.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.measurement import regular_clock
    >>> regular_clock(np.array([0.0, 0.011, 0.021, 0.03]), np.zeros(4, int)).round(4).tolist()
    [0.0, 0.01, 0.02, 0.03]
    """
    if q is not None:
        time = without_false_gaps(time, trajectory, rows_after_false_gaps(time, q, trajectory))
    regular = np.array(time, dtype=float)
    for rows in find_segments(trajectory, time):
        own = regular[rows]
        if len(own) < 3:
            continue
        # every row, or with missing rows according to the steps between stamps: the straighter one
        step = _step(own)
        every = np.arange(len(own))
        even = np.polyval(np.polyfit(every, own, 1), every)
        missing = (
            np.maximum(np.round(np.diff(own) / step), 1) if step > 0 else np.ones(len(own) - 1)
        )
        number = np.r_[0, np.cumsum(missing)]
        longer = np.polyval(np.polyfit(number, own, 1), number)
        many = np.mean(missing > 1) > MISSING
        # unlike a lost row, rounding makes as many steps too short as it makes too long
        made_up = 0 < np.sum(missing - 1) <= TWICE * np.sum(np.diff(own) < step / 2)
        rounded = (many or made_up) and np.ptp(own - even) < ROUNDED * step
        straighter = np.sum((even - own) ** 2) <= np.sum((longer - own) ** 2)
        regular[rows] = even if rounded or straighter else longer
    if len(regular):
        regular += time[0] - regular[0]
    return regular


def count_same_stamps(time: Array, q: Array, trajectory: NDArray[np.int64]) -> int:
    """Number of rows with the stamp of the previous row although joints moved; 0 if they are few.

    Parameters
    ----------
    time : ndarray of shape (n_samples,), s
        Recorded clock, before rows are left out.
    q : ndarray of shape (n_samples, n_joints), rad or m
        Recorded positions.
    trajectory : ndarray of shape (n_samples,)
        Trajectory of every row.

    Returns
    -------
    int
        Large for stamps that are rounded to more than a step of the samples.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.measurement import count_same_stamps
    >>> time = np.floor(np.arange(100) / 2) * 0.01
    >>> count_same_stamps(time, np.sin(np.arange(100.0))[:, None], np.zeros(100, int))
    50
    """
    same = (np.diff(time) == 0) & (trajectory[1:] == trajectory[:-1])
    moved = np.any(q[1:] != q[:-1], axis=1)
    count = int(np.sum(same & moved))
    return count if count > SAME * len(time) else 0


def _step(time: Array) -> float:
    """Step of a clock whose stamps jitter: the mean without the steps over missing rows."""
    steps = np.diff(time)
    whole = steps[steps < 1.5 * np.median(steps)]
    return float(np.mean(whole)) if len(whole) else float(np.median(steps))


@dataclass(frozen=True)
class Jitter:
    """Distance of stamps from a regular clock, and comparison of both with the positions.

    Attributes
    ----------
    spread : float, s
        Root mean square distance of the stamps from the regular clock.
    margin : float
        Twice the log-likelihood ratio of the positions for the regular clock against the stamps;
        positive if samples were taken at even steps.
    ratio : float
        Ratio of the errors of predicted positions with the stamps and with the regular clock.
    """

    spread: float
    margin: float
    ratio: float


def distance_from_regular(
    time: Array, trajectory: NDArray[np.int64]
) -> tuple[Array, list[slice], float]:
    """The regular clock, its parts, and the root mean square distance of the stamps from it, s."""
    regular = regular_clock(time, trajectory)
    segments = find_segments(trajectory, time)
    away = [time[r] - regular[r] - np.mean(time[r] - regular[r]) for r in segments]
    return regular, segments, float(np.sqrt(np.mean(np.concatenate(away) ** 2)))


def find_jitter(
    time: Array,
    q: Array,
    trajectory: NDArray[np.int64],
    repeated: NDArray[np.bool_] | None = None,
) -> Jitter:
    """Whether the stamps jitter or the samples really were uneven.

    Each position is predicted from its four neighbours by a cubic over time, once with the stamps
    and once with the regular clock; the right clock predicts better.

    Parameters
    ----------
    time : ndarray of shape (n_samples,), s
        Recorded clock.
    q : ndarray of shape (n_samples, n_joints), rad or m
        Recorded positions.
    trajectory : ndarray of shape (n_samples,)
        Trajectory of every row.
    repeated : ndarray of shape (n_samples,) of bool, optional
        Rows that repeat the previous one; their neighbours agree with neither clock.
    """
    regular, segments, spread = distance_from_regular(time, trajectory)
    margin, ratios = 0.0, []
    errors = []
    for clock in (time, regular):
        parts = [_prediction_errors(clock[rows], q[rows]) for rows in segments]
        errors.append(np.concatenate(parts))
    if repeated is not None and repeated.any():
        fresh = np.concatenate([_all_fresh(~repeated[rows]) for rows in segments])
        if len(fresh) == len(errors[0]) and fresh.sum() > FRESH:
            errors = [e[fresh] for e in errors]
    for k in range(q.shape[1]):
        with_stamps, even = (np.abs(e[:, k]) for e in errors)
        # the larger half shows the clock; the rest are rows with a joint at rest
        sizes = [float(np.mean(np.sort(e)[len(e) // 2 :] ** 2)) for e in (with_stamps, even)]
        if min(sizes) <= 0:
            continue
        # every position takes part in the prediction of four others
        margin += len(even) / 4 * np.log(sizes[0] / sizes[1])
        ratios.append(np.sqrt(sizes[0] / sizes[1]))
    return Jitter(spread, float(margin), float(np.max(ratios)) if ratios else 1.0)


def _all_fresh(fresh: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether a row and two on either side are not repetitions, without two rows at each end."""
    if len(fresh) < SHORTEST:
        return np.zeros(0, dtype=bool)
    return np.asarray(np.all([fresh[k : len(fresh) - 4 + k] for k in range(5)], axis=0))


def _prediction_errors(time: Array, q: Array) -> Array:
    """Positions minus their prediction by the cubic through two neighbours on either side."""
    n = len(time)
    if n < SHORTEST or np.any(np.diff(time) <= 0):
        return np.zeros((0, q.shape[1]))
    middle = np.arange(2, n - 2)
    around = time[middle[:, None] + NEIGHBOURS]
    weights = np.ones(around.shape)
    for a in range(4):
        for b in range(4):
            if a != b:
                weights[:, a] *= (time[middle] - around[:, b]) / (around[:, a] - around[:, b])
    predicted = np.einsum("ia,iak->ik", weights, q[middle[:, None] + NEIGHBOURS])
    gain = np.sqrt(1 + np.sum(weights**2, axis=1))  # the noise of the positions affects all equally
    return np.asarray((q[middle] - predicted) / gain[:, None])


class ClockJitter(Check):
    """Stamps that jitter although samples were taken at even steps."""

    name = "clock_jitter"
    suspects = "time stamps that jitter although samples were taken at even steps"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        signals = measurement.whole
        if measurement.same_stamps:
            yield self.suspicion(
                "the time stamps are too coarse for the samples",
                f"{measurement.same_stamps} rows have the time stamp of the previous row although "
                "joints have moved",
                "certain",
                remedy=remedy_of("clock", "regular"),
            )
            return
        if len(measurement.steps) < 50 or np.any(measurement.steps <= 0) or measurement.lost:
            return
        if measurement.repeated > MANY * measurement.n_samples:
            return  # the clock of the rows that are left may be even
        step = float(np.mean(measurement.steps[measurement.steps < 2.5 / measurement.rate]))
        if distance_from_regular(signals.clock, signals.trajectory)[2] < REGULAR * step:
            return
        again = repeated_rows(signals)
        found = find_jitter(signals.clock, signals.q, signals.trajectory, again)
        size = (
            f"{1e3 * found.spread:.3g} ms"
            if found.spread > 1e-4
            else (f"{1e6 * found.spread:.3g} us")
        )
        if found.margin > TOLD and found.spread > WANDERING * step:
            yield self.suspicion(
                "the clock drifts irregularly",
                f"its stamps lie {size} around even steps of {1e3 * step:.4g} ms, more than a "
                "step, so that no regular clock takes its place",
                "suspected",
            )
        elif found.margin > TOLD:
            measurement.stale = True
            yield self._jitters(measurement, found, size, step)
        elif measurement.jitter > 0.25:
            really = found.margin < -TOLD
            yield self.suspicion(
                "samples were taken at uneven steps" if really else "the time step varies",
                f"by {100 * measurement.jitter:.0f} % (5 to 95 % of the steps)"
                + ("; the positions agree with the stamps" if really else "")
                + ", and derivatives use the recorded times",
                "noted",
            )

    def _jitters(
        self, measurement: Measurement, found: Jitter, size: str, step: float
    ) -> Suspicion:
        """Stamps off even steps, and whether they do harm."""
        gained = _gained_by_torque(measurement)
        harmful = found.spread > OFF * step if gained is None else gained > HARM
        says = (
            ""
            if gained is None
            else "; with them the log-likelihood of the fit of the torque changes by "
            f"{round(gained):+d}"
            + ("" if harmful else ", so that the influence of the stamps is small")
        )
        sure = harmful and found.margin > CERTAIN and found.ratio > 1.2
        closer = found.ratio > CLOSER
        return self.suspicion(
            "the time stamps jitter, but the samples were taken at even steps",
            f"the stamps lie {size} around even steps of {1e3 * step:.4g} ms, and with even "
            f"steps a position follows from its neighbours up to {found.ratio:.3g} times as "
            f"closely{says}",
            "certain" if sure else "suspected" if harmful or closer else "noted",
            remedy=remedy_of("clock", "regular"),
        )


def _gained_by_torque(measurement: Measurement) -> float | None:
    """Log-likelihood gain of the torque by even steps; None without a robot.

    For slow motion accelerations have much jitter, but little influence.
    """
    fits = measurement.fits
    if fits is None:
        return None
    from skidyn.measurement._reading import Reading
    from skidyn.measurement._rows import make_fits  # also imports the evidence

    signals = measurement.whole
    even = signals.with_(time=regular_clock(signals.clock, signals.trajectory))
    other = make_fits(even, measurement.torque, fits.robot)
    if other is None or other.moving.shape != fits.moving.shape:
        return None
    other.moving = fits.moving  # likelihoods of the same rows
    return other.identified(Reading()).gained_over(fits.identified(Reading()))


class RepeatedRows(Check):
    """Rows that repeat the one before although joints move."""

    name = "repeated_rows"
    suspects = "rows that repeat the previous one: polled faster than the robot reports"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        count = measurement.repeated
        if count > REPEATED * measurement.n_samples:
            share = count / measurement.n_samples
            measurement.stale = True
            left_out = stale_rows(measurement.signals).any()
            yield self.suspicion(
                "rows repeat the previous one",
                f"in {count} of {measurement.n_samples} rows no position changes although joints "
                "move: the recorder polled faster than the robot reports, "
                + (
                    "and derivatives are computed without these rows"
                    if left_out
                    else "so derivatives are too noisy"
                ),
                "noted" if _coarse(measurement) else "certain" if share > MANY else "suspected",
                remedy=remedy_of("drop_repeated", True),
            )


def _coarse(measurement: Measurement) -> bool:
    """Whether rows repeat because the position sensor is coarse: torque then still changes."""
    s = measurement.signals
    if not moves_by_steps(s):
        return False
    same = np.all(s.q[1:] == s.q[:-1], axis=1) & s.within
    other = np.any(measurement.torque[1:] != measurement.torque[:-1], axis=1)
    return bool(np.mean(other[same]) > 0.5) if same.any() else False


class InterpolatedRows(Check):
    """Rows that lie on a straight line between their neighbours: resampled from a slower clock."""

    name = "interpolated_rows"
    suspects = "rows that were interpolated from a slower clock"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        s = measurement.signals
        if measurement.n_joints < 2:
            return
        # by chance, equal steps of coarse sensors are as frequent
        moving, on_line, knots = (0, 0, 0) if moves_by_steps(s) else _on_a_line(s, s.q)
        if moving > 50 and on_line > ON_A_LINE * moving:
            measurement.stale = True
            share = knots / moving  # one of so many rows, but for those at ends and rests
            every = round(1 / max(share, 1e-3))
            whole = abs(share * every - 1) < NEARLY
            rate = float(f"{measurement.rate / every if whole else measurement.rate * share:.4g}")
            yield self.suspicion(
                "rows were interpolated from a slower clock",
                f"in {100 * on_line / moving:.0f} % of the moving rows all joints lie on straight "
                "lines between their neighbours, so accelerations are those of the interpolation",
                "certain",
                remedy=resample_to(rate),
            )
            return
        moving, on_line, _ = _on_a_line(s, measurement.torque)
        if moving > 50 and on_line > ON_A_LINE * moving:
            measurement.smoothed = True
            yield self.suspicion(
                "torques were interpolated from a slower clock",
                f"in {100 * on_line / moving:.0f} % of the rows all of them lie on straight lines "
                "between their neighbours, but positions do not",
                "noted",
            )


def _on_a_line(signals: Signals, values: Array) -> tuple[int, int, int]:
    """Rows in which channels change, those in which they lie between their neighbours, and knots.

    A knot between two rows bends the channels in both, which are one knot together. Values of few
    digits lie beside a line by as much as these; a bend of any size is as frequent as a smaller one
    where the motion itself is smooth.
    """
    rounded = _straight(signals, values, FEW_DIGITS)
    if rounded[1] <= ON_A_LINE * rounded[0]:
        return rounded  # exactly on a line are even fewer
    wider = _straight(signals, values, FEW_DIGITS, CLEARLY)
    return rounded if wider[1] < NOT_BENT * rounded[1] else _straight(signals, values, 0.0)


def _straight(
    signals: Signals, values: Array, rounding: float, times: float = 1.0
) -> tuple[int, int, int]:
    """Changing rows, those on a line, and knots, for values of some relative rounding error.

    Bends of so many times the tolerance are accepted.
    """
    on_line, moving, knots = 0, 0, 0
    largest = np.abs(values).max(axis=0, initial=0.0)
    for rows in signals.segments:
        own, time = values[rows], signals.clock[rows]
        if len(own) < 10:
            continue
        steps = np.diff(time)
        slope = np.diff(own, axis=0) / steps[:, None]
        fastest = np.abs(slope).max(axis=0)
        moves = np.abs(slope[1:]) > 1e-3 * fastest + 1e-12
        least = rounding * largest / float(np.median(steps))
        least = times * np.clip(least, 1e-6 * fastest, 1e-3 * fastest)
        bend = np.abs(np.diff(slope, axis=0)) <= least
        both = moves.sum(axis=1) >= 2
        straight = np.all(bend | ~moves, axis=1)
        moving += int(both.sum())
        on_line += int((straight & both).sum())
        bent = both & ~straight
        knots += int(np.sum(bent & ~np.r_[False, bent[:-1]]))
    return moving, on_line, knots


class Gaps(Check):
    """Gaps in time inside trajectories."""

    name = "gaps"
    suspects = "gaps in time inside trajectories"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        gaps = measurement.gaps
        if len(gaps):
            yield self.suspicion(
                f"{len(gaps)} gap(s) in time inside trajectories",
                f"the longest lasts {gaps.max():.3g} s; filters and derivatives do not cross them",
                "noted",
            )


class SlowSampling(Check):
    """Too low a sampling rate for accelerations."""

    name = "slow_sampling"
    suspects = "a sampling rate that is too low for accelerations"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        if 2 <= measurement.rate < 20:
            yield self.suspicion(
                f"the log is sampled at {measurement.rate:.3g} Hz",
                "accelerations, and therefore inertias, cannot be determined at this rate",
                "noted",
            )
