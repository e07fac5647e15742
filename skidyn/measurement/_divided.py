# SPDX-License-Identifier: BSD-3-Clause
"""Comparison of recordings: a third to half of them with another sign, scale or zero of a joint.

A single recording that differs is seen by bodies of the others. Where many differ, bodies of all of
them are those of none. So the torque of a joint is one function of its motion, times one of two
multiples, or with one of two zeros, and which one a recording has is fitted as well.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from math import comb
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn._text import trajectories_told
from skidyn.measurement._bodies import explained
from skidyn.measurement._check import Check
from skidyn.measurement._duel import gained_over_effects, left_by_effects
from skidyn.measurement._fits import Fits, lines_between
from skidyn.measurement._gains import CLEARLY, joint_gain
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._outcome import Outcome
from skidyn.measurement._peak import climb
from skidyn.measurement._reading import Reading
from skidyn.measurement._robust import fit_at_once, fit_together
from skidyn.measurement._suspicion import Suspicion
from skidyn.measurement._torque import asked_gain

#: Fewest recordings, and rows of each, to be compared.
RECORDINGS, FEWEST = 4, 12
#: Least share of the recordings that differ; fewer are found one by one.
SHARE = 0.3
#: Error of identified bodies, as a share of the spread, from which recordings are divided.
WORTH = 0.08
#: How nearly the multiples of either group must be the same, as a share, and what they may differ
#: by without a mistake: a payload or friction that changes.
ALIKE, USUAL = 0.25, (0.4, 2.5)
#: Rounds of the fit of multiples, and its ridge.
ROUNDS, RIDGE = 12, 1e-6
#: Log-likelihood that two groups must gain with identified bodies, the share of the residual that
#: they must take off, and what they may leave of what the best effect leaves.
SURE, DROP, BETTER = 40.0, 0.4, 0.8
#: How many times as much two groups must gain as another reading of all recordings.
MORE = 1.25
#: Zeros that are tried, and the least that is reported, rad.
ZEROS, LEAST_ZERO = np.deg2rad([-60, -40, -20, 20, 40, 60]), np.deg2rad(4)
#: Zeros that are examined in detail, rows for the choice of them, and most groups of recordings
#: that are all tried.
FINALISTS, ROWS, MOST_GROUPS = 4, 400, 100


#: Rough gain, joint, angle and recordings of a zero.
Tried: TypeAlias = tuple[float, int, float, NDArray[np.int64]]


@dataclass(frozen=True)
class Division:
    """Recordings in which a joint has another multiple, or another zero.

    Attributes
    ----------
    kind : {"sign", "scale", "zero"}
        Difference.
    joint : int
        Joint, from 0.
    runs : tuple of int
        The recordings that differ; at most half.
    value : float
        Multiple of the torque, or angle of the zero, rad.
    gain, drop : float
        Log-likelihood gain with identified bodies, and share of the residual that it takes off.
    """

    kind: str
    joint: int
    runs: tuple[int, ...]
    value: float
    gain: float
    drop: float


class DividedRecordings(Check):
    """A joint with another sign, scale or zero in a third to half of the recordings."""

    name = "divided_recordings"
    suspects = "several recordings with another sign, scale or zero of one joint than the others"
    stage = 1
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        if measurement.stale or measurement.lost or measurement.odd:
            return
        seen = explained(measurement)
        if seen is None or seen.errors[1].max() < WORTH:
            return
        fits = seen.fits
        zeros = list(divided_zeros(fits))
        found = [*_divided_torques(fits, seen.joints), *zeros]
        if not found:
            return
        best = max(found, key=lambda one: one.gain)
        if best.kind == "zero" and _is_scale(fits.loaded(), best):
            return
        if len(best.runs) == 1:
            measurement.one_zero = best  # for the check of single recordings
            return
        if MORE * asked_gain(measurement, fits) > best.gain:
            return
        measurement.odd = True
        name = measurement.joint(best.joint)
        what = {
            "sign": f"the torque of {name} has the opposite sign",
            "scale": f"the torque of {name} is {best.value:.3g} times that of the others",
            "zero": f"the zero of {name} differs by about {np.rad2deg(best.value):.0f} deg",
        }[best.kind]
        yield self.suspicion(
            f"in {trajectories_told(best.runs)} {what}",
            "with this correction, identified bodies explain the torque of all trajectories better "
            f"by {best.gain:.0f} (log-likelihood) and leave {100 * best.drop:.0f} % less residual; "
            "fix these files, or diagnose them separately",
            "suspected",
            [best.joint],
        )


def _is_scale(fits: Fits, zero: Division) -> bool:
    """Whether another scale of a torque in all recordings explains more than a zero in some."""
    gains = fits.nominal(Reading()).gain
    odd = [k for k, gain in enumerate(gains) if gain > 0 and not CLEARLY[0] < gain < CLEARLY[1]]
    return any(joint_gain(fits, k, float(gains[k]))[1] > zero.gain for k in odd)


def _divided_torques(fits: Fits, joints: list[int]) -> Iterator[Division]:
    """Joints whose torque has one of two multiples."""
    runs = np.unique(fits.recording)
    columns, here = fits.columns(Reading()), fits.identified(Reading())
    for k in joints:
        y, use = fits.mean_torque(k)
        rows = [use & (fits.recording == run) for run in runs]
        told = [i for i, own in enumerate(rows) if own.sum() >= FEWEST and np.any(y[own])]
        if len(told) < RECORDINGS:
            continue
        design = np.column_stack([columns[:, :, k], np.ones(len(y))])
        multiples = _multiples([design[rows[i]] for i in told], [y[rows[i]] for i in told])
        split = _two_groups(multiples)
        if split is None:
            continue
        others, value = split
        out = runs[[told[i] for i in np.flatnonzero(others)]]
        odd = np.isin(fits.recording, out)
        flexible = _flexible(fits, k)
        value = _refined(flexible, y[use], odd[use], value)
        if USUAL[0] < value < USUAL[1] or value == 0:
            continue
        torque = fits.torque.copy()
        torque[np.isin(fits.signals.trajectory, out), k] /= value
        mended = fits.with_torque(torque)
        there = mended.identified(Reading())
        margin = there.margin(here)
        changed = float(odd[use].sum()) * np.log(abs(value))
        margin[k] -= changed / there.inflation_of(k)
        after = mended.mean_torque(k)[0]
        drop = 1 - _left(there.residual[k], after[use]) / _left(here.residual[k], y[use])
        gain = float(margin.sum())
        if gain <= SURE or drop <= DROP:
            # what bodies do not explain, such as a spring, is a function of the position
            gain, drop = _flexible_gain(flexible, y[use], after[use], changed)
        if gain > SURE and drop > DROP and _unlike_effects(fits, mended, k, odd, abs(value)):
            kind = "sign" if USUAL[0] < -value < USUAL[1] else "scale"
            yield Division(kind, k, tuple(map(int, out)), value, gain, drop)


def _flexible(fits: Fits, k: int) -> Array:
    """Columns of the torque of a joint: bodies of its own, and any function of its position."""
    _, use = fits.mean_torque(k)
    q = fits.average(fits.signals.q[:, k])[use]
    return np.hstack([fits.felt(k)[0][use], lines_between(q)])


def _refined(columns: Array, y: Array, odd: NDArray[np.bool_], value: float) -> float:
    """Multiple of the torque of some rows of which the others have one."""
    size = np.linalg.norm(columns, axis=0) + 1e-12
    for _ in range(ROUNDS):
        x = columns / size * np.where(odd, value, 1.0)[:, None]
        gram = x.T @ x + RIDGE * np.trace(x.T @ x) / x.shape[1] * np.eye(x.shape[1])
        predicted = columns / size @ np.linalg.solve(gram, x.T @ y)
        square = float(predicted[odd] @ predicted[odd])
        value = float(y[odd] @ predicted[odd]) / square if square > 0 else 0.0
    return value


def _flexible_gain(columns: Array, y: Array, after: Array, changed: float) -> tuple[float, float]:
    """Log-likelihood gain of a changed torque with such columns, and what it takes off."""
    place = [np.arange(columns.shape[1])]
    here, there = (fit_together([columns], place, [torque])[0] for torque in (y, after))
    gain = there.likelihood - here.likelihood - changed
    drop = 1 - _left(there.residual, after) / _left(here.residual, y)
    return gain / (there if gain > 0 else here).inflation, drop


def _left(residual: Array, y: Array) -> float:
    """Spread of a residual as a share of that of the torque."""
    return _spread(residual) / _spread(y)


def _multiples(designs: list[Array], targets: list[Array]) -> Array:
    """Multiple of every recording of one function of the motion, by turns with its coefficients."""
    scale = np.linalg.norm(np.vstack(designs), axis=0) + 1e-12
    best, found = np.inf, np.ones(len(targets))
    for reference in np.argsort([-len(y) for y in targets])[:3]:
        multiples = np.zeros(len(targets))
        multiples[reference] = 1.0
        for _ in range(ROUNDS):
            x = np.vstack([m * d for m, d in zip(multiples, designs, strict=True)]) / scale
            gram = x.T @ x + 1e-6 * np.eye(x.shape[1]) * (np.sum(x**2) / x.shape[1] + 1e-300)
            c = np.linalg.solve(gram, x.T @ np.concatenate(targets)) / scale
            predicted = [d @ c for d in designs]
            multiples = np.array(
                [y @ p / (p @ p + 1e-300) for y, p in zip(targets, predicted, strict=True)]
            )
        left = sum(
            float(np.sum((y - m * p) ** 2)) / (float(y @ y) + 1e-300)
            for y, p, m in zip(targets, predicted, multiples, strict=True)
        )
        if left < best:
            # as multiples of the stated bodies, or of friction, which is positive
            heavy = abs(c[0]) * scale[0] > abs(c[2]) * scale[2]
            best, found = left, multiples * (c[0] if heavy else np.sign(c[2]) or 1.0)
    return found


def _two_groups(multiples: Array) -> tuple[NDArray[np.bool_], float] | None:
    """Recordings whose multiple is another one than that of the others, and their ratio."""
    n = len(multiples)
    order = np.sort(multiples)
    cut = int(np.argmax(np.diff(order)))
    if np.any(multiples < 0):
        low = multiples < 0
    else:
        logs = np.log(np.maximum(order, 1e-6))
        cut = int(np.argmax(np.diff(logs)))
        low = multiples <= order[cut]
    size = int(low.sum())
    if not SHARE * n <= size <= (1 - SHARE) * n:
        return None
    others = low if 2 * size <= n else ~low
    if 2 * size == n:  # those are right that are nearer to the stated bodies
        middles = [float(np.median(multiples[part])) for part in (low, ~low)]
        far = [np.inf if m <= 0 else abs(np.log(m)) for m in middles]
        others = low if far[0] > far[1] else ~low
    usual, other = float(np.median(multiples[~others])), float(np.median(multiples[others]))
    if usual == 0:
        return None
    value = other / usual
    spread = [
        float(np.median(np.abs(multiples[part] / middle - 1)))
        for part, middle in ((others, other), (~others, usual))
        if middle != 0
    ]
    if len(spread) < 2 or max(spread) > ALIKE or USUAL[0] < value < USUAL[1] or value == 0:
        return None
    return others, -1.0 if USUAL[0] < -value < USUAL[1] else value


def divided_zeros(fits: Fits) -> Iterator[Division]:
    """A joint whose position has one of two zeros, or another one in a single recording.

    Parameters
    ----------
    fits : Fits
        Rows.
    """
    runs = np.unique(fits.recording)
    turning = np.flatnonzero(~fits.signals.prismatic).tolist()
    if len(runs) < RECORDINGS or not turning:
        return
    here = fits.identified(Reading())
    few = fits.thinned(ROWS)
    tried: list[Tried] = []
    for k in turning:
        for angle in ZEROS.tolist():
            gain, group = _best_group(len(runs), partial(_likelihoods, few, here, k, angle))
            tried.append((gain, k, angle, runs[group]))
    tried.sort(key=lambda one: -one[0])
    # a zero of the last joint is a load of these recordings, which has more coefficients
    loaded = fits.loaded()
    for rows in (loaded, fits)[loaded is fits :]:
        found = _refined_zero(rows, tried[:FINALISTS])
        if found is not None:
            yield found
            return


def _refined_zero(fits: Fits, tried: list[Tried]) -> Division | None:
    """The best of some zeros, as identified bodies need it; None if they do not."""
    runs = np.unique(fits.recording)
    here = fits.identified(Reading())

    def mended(k: int, angle: float, out: NDArray[np.int64]) -> Fits:
        q = fits.signals.q.copy()
        q[np.isin(fits.signals.trajectory, out), k] -= angle
        return fits.with_motion(fits.signals.with_(q=q))

    def margin(k: int, angle: float, out: NDArray[np.int64]) -> float:
        return mended(k, angle, out).identified(Reading()).gained_over(here)

    value, k, angle, out = max(
        ((margin(*one[1:]), *one[1:]) for one in tried), key=lambda one: one[0]
    )
    if value < SURE:
        return None
    of_angle = partial(margin, k, out=out)
    angle, value = climb(of_angle, angle, np.deg2rad(10), np.deg2rad(1))
    if abs(angle) < LEAST_ZERO:
        return None
    if 2 * len(out) > len(runs):
        out, angle = np.setdiff1d(runs, out), -angle
    fixed = mended(k, angle, out)
    there = fixed.identified(Reading())
    worst = int(np.argmax(there.margin(here)))
    drop = 1 - float(_spread(there.residual[worst]) / _spread(here.residual[worst]))
    odd = np.isin(fits.recording, out)
    if drop <= DROP or not _unlike_effects(fits, fixed, worst, odd):
        return None
    # a payload of half of many recordings is seen by all joints, and another zero by its own
    if gained_over_effects(fits, fixed, worst, odd) <= 0:
        return None
    return Division("zero", k, tuple(map(int, out)), angle, value, drop)


def _unlike_effects(
    fits: Fits, mended: Fits, joint: int, rows: NDArray[np.bool_], value: float = 1.0
) -> bool:
    """Whether an effect, such as a payload in these recordings, leaves clearly more than a mistake.

    A payload multiplies the weight that a wrist carries. The same effects may be beside a mistake.
    """
    with_it, without = (left_by_effects(f, joint, rows)[2] for f in (mended, fits))
    return with_it < BETTER * without / value


def _best_group(n: int, likelihoods: Callable[[list[list[int]]], Array]) -> tuple[float, list[int]]:
    """The likeliest group of up to half of n recordings, by their numbers from 0.

    Of many recordings not all groups are tried, but from a group those with one more or one fewer.
    """
    sizes = range(1, n // 2 + 1)
    if sum(comb(n, size) for size in sizes) <= MOST_GROUPS:
        groups = [list(group) for size in sizes for group in combinations(range(n), size)]
        values = likelihoods(groups)
        return float(values.max()), groups[int(np.argmax(values))]
    group: list[int] = []
    value = -np.inf
    while True:
        groups = [sorted({k} ^ set(group)) for k in range(n)]
        groups = [g for g in groups if len(g) in sizes]
        values = likelihoods(groups)
        if group and values.max() <= value:
            return value, group
        value, group = float(values.max()), groups[int(np.argmax(values))]


def _likelihoods(
    fits: Fits, known: Outcome, joint: int, angle: float, groups: list[list[int]]
) -> Array:
    """Log-likelihood of another zero in every group of recordings, with stated bodies.

    Friction and the scale of every torque are common to all recordings, and fitted anew for every
    group: where many recordings differ, those of all of them are right for none.
    """
    runs = np.unique(fits.recording)
    plain, turned = (fits.columns(Reading(zero=zero)) for zero in ((), ((joint, angle),)))
    felt = [
        k
        for k in range(fits.n_joints)
        if fits.usable(k) and np.any(plain[..., k] != turned[..., k])
    ]
    total = np.zeros(len(groups))
    for k in felt:
        y, use = fits.mean_torque(k)
        before = fit_at_once(plain[None, :, :, k], y[None], use[None])[0].likelihood
        columns = np.stack(
            [
                np.where(np.isin(fits.recording, runs[g])[:, None], turned[..., k], plain[..., k])
                for g in groups
            ]
        )
        shape = len(groups), len(y)
        fitted = fit_at_once(columns, np.broadcast_to(y, shape), np.broadcast_to(use, shape))
        after = [fit.likelihood for fit in fitted]
        total += (np.array(after) - before) / known.inflation_of(k)
    return total


def _spread(values: Array) -> float:
    return float(np.std(values)) + 1e-12
