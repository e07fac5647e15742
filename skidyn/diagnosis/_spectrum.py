# SPDX-License-Identifier: BSD-3-Clause
"""Lines in spectra of the residual at the full rate: torque ripple over angle, vibration."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.optimize import minimize_scalar

from skidyn._signals import Array
from skidyn.diagnosis._chance import chance_of_score
from skidyn.diagnosis._clock import clock_line
from skidyn.diagnosis._parts import FEWEST, best_parts, n_parts
from skidyn.diagnosis._profile import QUARTERS
from skidyn.diagnosis._rule import SHORTEST_BLOCK
from skidyn.effects import Term
from skidyn.evidence import Problem

#: Angle covered by the spectrum in rad and its number of bins; sets resolution and range.
SPAN, BINS = 4 * np.pi, 32768
#: Waves per rad searched, or per 0.1 m.
LOWEST, HIGHEST = 8.0, 420.0
#: Least number of waves within the range of the joint; fewer can represent any function of
#: position.
WITHIN_RANGE = 2.0
#: Slowest vibration in Hz; slower ones are visible in averaged rows (window of 1/8 s).
SLOWEST = 8.0
#: Least height of a line, in units of the local noise.
LEAST_HEIGHT = 8.0
#: Width in bins of the running median that gives the local noise level.
MEDIAN_WIDTH = 161
#: Least number of blocks of samples for the test of a line, since its wave is fast and the
#: correlation with other torques lasts only a part of a second.
LINE_BLOCKS = 60
#: Number of waves within the range of a joint from which they differ from torques of bodies, and
#: number of positions at which fewer waves are fitted.
MANY, PLACES = 8.0, 400
#: Step between the waves per rad that are tried around a line, and number of corrections after it.
GRID, CORRECTIONS = 0.05, 2


@dataclass(frozen=True)
class Line:
    """A line in the spectrum of a joint's residual over its angle or over time.

    Attributes
    ----------
    joint : int
        Joint, from 0.
    term : Term
        Its sine and cosine.
    chance : float
        Probability of a line of this height anywhere in the spectrum of the joint in noise, and in
        any part of the recordings.
    gain : ndarray of shape (n_folds,)
        Twice the held-out log-likelihood gain, by fold.
    torque : ndarray of shape (n_samples,), N m or N
        The wave.
    n_parts : float
        Number of parts of the recordings among which its own was chosen.
    """

    joint: int
    term: Term
    chance: float
    gain: Array
    torque: Array
    n_parts: float = 1.0


def _any(chance: float) -> bool:
    return True


def find_lines(
    problem: Problem,
    residual: Array,
    significant: Callable[[float], bool] = _any,
    joints: Iterable[int] | None = None,
) -> list[Line]:
    """The strongest significant lines of each joint above the local noise level.

    Parameters
    ----------
    problem : Problem
        Motion and the samples that slide.
    residual : ndarray of shape (n_samples, n_joints), N m
        Measured torque less the model.
    significant : callable, optional
        Whether a line of a chance is wanted; all by default.
    joints : iterable of int, optional
        Joints, from 0; all by default.
    """
    fold = problem.sample_folds(int(np.argmax(problem.rows.counts)))
    lines = []
    for joint in range(problem.n_joints) if joints is None else joints:
        use = problem.rows.sliding[:, joint]
        if use.sum() < 100:
            continue
        unit = float(problem.signals.unit[joint])  # waves of a slider are shorter by this factor
        q, r = problem.signals.q[:, joint] / unit, residual[:, joint]
        for waves, height in _peaks(q[use], r[use]):
            if height < LEAST_HEIGHT:
                continue
            # Power over its level is exponentially distributed; the highest wave of a joint is
            # tested.
            chance = min(1.0, 2 * HIGHEST * float(np.exp(-height)))
            if not significant(chance):
                continue
            waves = _refined_wave(q[use], r[use], waves)
            term = Term.at("torque_ripple", (joint,), {"N": waves / unit})
            line = tested_line(problem, term, chance, 2 * HIGHEST, use, r, fold)
            line = _in_part(problem, line, chance, use, r) or line
            weak = _explained_share(r[use], line.torque[use]) <= 0.2
            lines.append(_capped(line, height) if weak else line)
    return lines


def _in_part(
    problem: Problem, line: Line, chance: float, use: NDArray[np.bool_], r: Array
) -> Line | None:
    """The line in a part of the recordings, if it explains more there than in all of them.

    ``chance`` is that of its height in the spectrum of all of them.
    """
    trajectory, sigma = problem.signals.trajectory, np.std(r[use])
    names = np.unique(trajectory)
    if len(names) < FEWEST or sigma == 0:
        return None
    block = line.term.torque_columns(problem.signals)[line.joint] / sigma
    parts = [(block[here], r[here] / sigma) for n in names for here in [use & (trajectory == n)]]
    score, own = np.array([b.T @ y for b, y in parts]), np.array([b.T @ b for b, _ in parts])
    (part,) = best_parts(names, score[None], own[None])
    if part is None:
        return None
    inside = use & np.isin(trajectory, part.recordings)
    unit = float(problem.signals.unit[line.joint])
    q = problem.signals.q[:, line.joint] / unit
    waves = line.term.shape["N"] * unit
    if waves * np.ptp(q[inside]) < WITHIN_RANGE * 2 * np.pi:
        return None  # these recordings can represent it by any function of position
    waves = _refined_wave(q[inside], r[inside], waves)
    term = line.term.with_shape(N=waves / unit, trajectories=part.recordings)
    # Quarters of the samples are left out, since a single recording may contain the line.
    fold = sample_blocks(problem)[0] % QUARTERS
    found = tested_line(problem, term, chance, 2 * HIGHEST, use, r, fold)
    if found.gain.sum() <= line.gain.sum():
        return None
    tried = n_parts(len(names), len(part.recordings))
    return replace(found, chance=min(1.0, found.chance * tried), n_parts=tried)


def find_vibrations(
    problem: Problem,
    residual: Array,
    significant: Callable[[float], bool] = _any,
    joints: Iterable[int] | None = None,
) -> list[Line]:
    """The strongest wave in time of each joint that is too fast for averaged rows.

    Parameters
    ----------
    problem : Problem
        Motion and the samples that slide.
    residual : ndarray of shape (n_samples, n_joints), N m or N
        Measured torque less the model.
    significant : callable, optional
        Whether a line of a chance is wanted; all by default.
    joints : iterable of int, optional
        Joints, from 0; all by default.
    """
    signals, lines = problem.signals, []
    if signals.time is None:
        return []
    fold = problem.sample_folds(int(np.argmax(problem.rows.counts)))
    for joint in range(problem.n_joints) if joints is None else joints:
        use, r = problem.rows.sliding[:, joint], residual[:, joint]
        found = clock_line(signals, r, use, problem.signals.rate, (SLOWEST, np.inf))
        if found is not None and significant(found.chance):
            term = Term.at("vibration", (joint,), {"frequency": found.frequency})
            line = tested_line(problem, term, found.chance, 1.0, use, r, fold)
            lines.append(_capped(line, found.height))
    return lines


def _capped(line: Line, height: float) -> Line:
    """A line whose gain is limited to that of its height over the local noise."""
    total = float(line.gain.sum())
    return replace(line, gain=line.gain * min(1.0, 2.4 * height / total)) if total > 0 else line


def _spectrum(q: Array, r: Array) -> tuple[Array, Array]:
    """Power over waves per SPAN, and its local noise level."""
    bins = np.floor((q + SPAN / 2) / SPAN * BINS).astype(int) % BINS
    power = np.abs(np.fft.rfft(np.bincount(bins, r, BINS))) ** 2
    power = power[: int(HIGHEST * SPAN / (2 * np.pi))]
    # The median of exponentially distributed power is log 2 times its mean.
    level = median_filter(power, MEDIAN_WIDTH, mode="nearest") / np.log(2)
    return power, np.maximum(level, np.finfo(float).tiny)


def _peaks(q: Array, r: Array) -> list[tuple[float, float]]:
    """Waves and heights (power over the level without the line) of the top two lines."""
    power, level = _spectrum(q, r)
    ratio = power / level
    lowest = max(LOWEST, WITHIN_RANGE * 2 * np.pi / max(float(np.ptp(q)), 1e-12))
    ratio[: int(min(lowest, HIGHEST) * SPAN / (2 * np.pi))] = 0.0
    peaks = []
    for _ in range(2):
        k = int(np.argmax(ratio))
        ratio[max(0, k - 8) : k + 9] = 0.0
        waves = _strongest_wave(q, r, k / 2 - 0.5, k / 2 + 0.5)
        block = np.column_stack([np.sin(waves * q), np.cos(waves * q)])
        rest = r - block @ np.linalg.lstsq(block, r, rcond=None)[0]
        peaks.append((waves, float(power[k] / _spectrum(q, rest)[1][k])))
    return peaks


def _strongest_wave(q: Array, r: Array, lowest: float, highest: float) -> float:
    """Of evenly spaced waves, the one with the largest amplitude in a signal over q."""
    # Each wave is the previous one rotated by the same angle at every sample: one product of
    # complex numbers instead of a sine and a cosine.
    count = 1 + round((highest - lowest) / GRID)
    turned, turn = r * np.exp(-1j * lowest * q), np.exp(-1j * (highest - lowest) / (count - 1) * q)
    strength = []
    for _ in range(count):
        strength.append(float(np.abs(turned.sum())))
        turned *= turn
    return float(np.linspace(lowest, highest, count)[int(np.argmax(strength))])


def _correction(q: Array, r: Array, waves: float) -> float:
    """Change to the waves of a line, found on a grid, by one step of least squares."""
    wave = np.exp(1j * waves * q)
    columns = [wave.real, wave.imag]
    block = np.column_stack(columns)
    cosine, sine = np.linalg.solve(block.T @ block, block.T @ r)
    # about the mean position, so that the phase there and the number of waves are independent
    slope = (q - q.mean()) * (sine * wave.real - cosine * wave.imag)
    block = np.column_stack([*columns, slope])
    change = np.linalg.lstsq(block.T @ block, block.T @ r, rcond=None)[0][2]
    return float(np.clip(change, -2 * GRID, 2 * GRID))


def _refined_wave(q: Array, r: Array, waves: float) -> float:
    """Waves that explain most of a signal in addition to torques of bodies and springs.

    A wave with few periods in the range of q is not orthogonal to the functions that the model has
    removed from the signal, so its peak is shifted.
    """
    span = float(np.ptp(q))
    if waves * span > MANY * 2 * np.pi:
        for _ in range(CORRECTIONS):
            waves += _correction(q, r, waves)
        return waves
    bins = np.minimum(((q - q.min()) / span * PLACES).astype(int), PLACES - 1)
    count = np.bincount(bins, minlength=PLACES)
    held = count > 0
    x = np.bincount(bins, q, PLACES)[held] / count[held]
    weight = np.sqrt(count[held])
    y = np.bincount(bins, r, PLACES)[held] / weight

    def left(tried: float) -> float:
        wave = [np.sin(tried * x), np.cos(tried * x)]
        block = np.column_stack([np.ones_like(x), x, np.sin(x), np.cos(x), *wave])
        block *= weight[:, None]
        return float(np.sum((y - block @ np.linalg.lstsq(block, y, rcond=None)[0]) ** 2))

    width = np.pi / span  # half the distance of waves that the range can separate
    lowest = max(waves - width, WITHIN_RANGE * 2 * width)
    found = minimize_scalar(left, bounds=(lowest, waves + width), method="bounded")
    return float(found.x) if found.fun < left(waves) else waves


def sample_blocks(
    problem: Problem, recordings: tuple[int, ...] | None = None
) -> tuple[NDArray[np.int64], int]:
    """Block of every sample and their number; half a second long, less in few recordings."""
    index: NDArray[np.int64] = np.zeros(problem.signals.n_samples, dtype=np.int64)
    first = [problem.signals.trajectory[rows][0] for rows in problem.signals.segments]
    clocks = [problem.signals.clock[rows] for rows in problem.signals.segments]
    judged = [recordings is None or name in recordings for name in first]
    span = sum(float(np.ptp(clock)) for clock, own in zip(clocks, judged, strict=True) if own)
    length = min(SHORTEST_BLOCK, span / LINE_BLOCKS) or SHORTEST_BLOCK  # samples that stand alone
    count = 0
    for rows, clock in zip(problem.signals.segments, clocks, strict=True):
        index[rows] = count + ((clock - clock[0]) / length).astype(np.int64)
        count = int(index[rows].max()) + 1
    return index, count


def tested_line(
    problem: Problem,
    term: Term,
    chance: float,
    tried: float,
    use: NDArray[np.bool_],
    r: Array,
    fold: NDArray[np.int64],
) -> Line:
    """A wave over the angle or over time with its size, its chance and its held-out gain.

    Parameters
    ----------
    problem : Problem
        Motion.
    term : Term
        The wave.
    chance : float
        Probability of its height in noise.
    tried : float
        Number of waves of which it is the strongest.
    use : ndarray of shape (n_samples,) of bool
        Samples that slide.
    r : ndarray of shape (n_samples,), N m or N
        Residual of its joint.
    fold : ndarray of shape (n_samples,)
        Fold of every sample.
    """
    (joint,) = term.places
    block = term.torque_columns(problem.signals)[joint]
    rows = np.flatnonzero(use)
    rows = rows[np.argsort(fold[rows], kind="stable")]
    edges = np.flatnonzero(np.diff(fold[rows])) + 1
    grams, cross = [], []
    for here in np.split(rows, edges):
        grams.append(block[here].T @ block[here])
        cross.append(block[here].T @ r[here])
    total, right = sum(grams), sum(cross)
    both = np.linalg.lstsq(total, right, rcond=None)[0]
    left = (r - block @ both)[use]
    part = term.trajectories
    steps, count = problem.signals.once(
        f"blocks of samples of {part}", lambda: sample_blocks(problem, part)
    )
    sums: Array = np.stack([np.bincount(steps[use], z * left, count) for z in block[use].T], axis=1)
    by_blocks = chance_of_score(np.asarray(right), sums[np.any(sums != 0, axis=1)])
    chance = max(chance, min(1.0, tried * by_blocks))
    drop = []
    for g, c in zip(grams, cross, strict=True):
        b = np.linalg.lstsq(total - g, right - c, rcond=None)[0]
        drop.append(2 * b @ c - b @ g @ b)
    before = float(np.sum(r[use] ** 2))
    change = np.array(drop)
    gain = use.sum() * np.log(before / max(before - change.sum(), 1e-12 * before))
    shares = change / change.sum() * gain if change.sum() > 0 else 0 * change
    return Line(joint, term, chance, shares, block @ both)


def _explained_share(r: Array, wave: Array) -> float:
    return 1 - float(np.sum((r - wave) ** 2) / np.sum(r**2))
