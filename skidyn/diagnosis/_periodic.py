# SPDX-License-Identifier: BSD-3-Clause
"""Ripple that is no sine: waves of another form, as of teeth and of cams, or of two lengths."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from skidyn._signals import Array
from skidyn.diagnosis._spectrum import HIGHEST, PLACES, Line, tested_line
from skidyn.effects import Term
from skidyn.evidence import Problem

#: Number of harmonics of a wave.
HARMONICS = 5
#: Fewest waves within the motion, of which fewer can represent any function of the position, and
#: most, of which more are lines in a spectrum; step between those that are tried.
FEWEST, MOST, STEP = 2.5, 24.0, 0.1
#: Share of what waves explain that fewer harmonics of the same waves may leave.
SAME = 0.02
#: Least difference of the numbers of two waves within the motion.
APART = 0.7
#: Least share of the residual of a joint that the waves explain.
LEAST_SHARE = 0.2


def find_periodic(
    problem: Problem,
    residual: Array,
    joints: Iterable[int],
    significant: Callable[[float], bool],
) -> list[Line]:
    """The strongest significant periodic torque over the position of each of some joints.

    Parameters
    ----------
    problem : Problem
        Motion and the samples that slide.
    residual : ndarray of shape (n_samples, n_joints), N m or N
        Measured torque less the model.
    joints : iterable of int
        Joints, from 0.
    significant : callable
        Whether a torque of a chance is wanted.
    """
    fold = problem.sample_folds(int(np.argmax(problem.rows.counts)))
    found = []
    for joint in joints:
        use, r = problem.rows.sliding[:, joint], residual[:, joint]
        q = problem.signals.q[:, joint]
        if use.sum() < PLACES or np.ptp(q[use]) == 0:
            continue
        shape = _best_shape(q[use], r[use])
        if shape is None:
            continue
        term = Term.at("torque_ripple", (joint,), shape)
        line = tested_line(problem, term, 0.0, 2 * HIGHEST, use, r, fold)
        if significant(line.chance):
            found.append(line)
    return found


def _best_shape(q: Array, r: Array) -> dict[str, float] | None:
    """Shape of the waves that explain most of a residual; None if they explain little.

    They are harmonics of one wave, or two waves of any lengths.
    """
    low, span = float(q.min()), float(np.ptp(q))
    bins = np.minimum(((q - low) / span * PLACES).astype(int), PLACES - 1)
    count = np.bincount(bins, minlength=PLACES)
    held = count > 0
    # positions between 0 and 1, of which the waves are counted
    x = (np.bincount(bins, q, PLACES)[held] / count[held] - low) / span
    weight = np.sqrt(count[held])
    y = np.bincount(bins, r, PLACES)[held] / weight
    most = (1 - LEAST_SHARE) * float(r @ r)
    within = float(r @ r) - float(y @ y)
    if within > most:
        return None  # whatever the form of the waves
    smooth = np.column_stack([np.ones_like(x), x, np.sin(span * x), np.cos(span * x)])

    def left(*waves: Array) -> float:
        block = np.hstack([smooth, *waves]) * weight[:, None]
        return float(np.sum((y - block @ np.linalg.lstsq(block, y, rcond=None)[0]) ** 2))

    def wave(waves: float, orders: int = 1) -> Array:
        return harmonics(2 * np.pi * waves * x, orders)

    def both(waves: Array) -> float:
        near = min(waves) < FEWEST or abs(waves[0] - waves[1]) < APART
        return np.inf if near else left(wave(waves[0]), wave(waves[1]))

    def repeated(waves: float) -> float:
        return left(wave(waves, HARMONICS))

    first, harmonic = _best(repeated)
    # Waves of half the number explain at least as much.
    for order in (2, 3):
        whole, other = _near(repeated, order * first)
        if whole < MOST and other < harmonic + SAME * (float(y @ y) - harmonic):
            first, harmonic = whole, other
            break
    one, _ = _best(lambda waves: left(wave(waves)))
    two, _ = _best(lambda waves: both(np.array([one, waves])))
    found = minimize(both, [one, two], method="Nelder-Mead", options={"xatol": 1e-4, "fatol": 0})
    if within + min(harmonic, found.fun) > most:
        return None
    unit = 2 * np.pi / span
    if harmonic <= found.fun:
        return {"N": first * unit, "harmonics": float(HARMONICS)}
    return {"N": float(found.x[0]) * unit, "second": float(found.x[1]) * unit}


def _best(left: Callable[[float], float]) -> tuple[float, float]:
    """The number of waves that leaves least, and what it leaves."""
    tried = np.arange(FEWEST, MOST, STEP).tolist()
    return _near(left, min(tried, key=left))


def _near(left: Callable[[float], float], waves: float) -> tuple[float, float]:
    """The best number of waves near one, and what it leaves."""
    bounds = max(FEWEST, waves - STEP), waves + STEP
    found = minimize_scalar(left, bounds=bounds, method="bounded")
    return float(found.x), float(found.fun)


def harmonics(phase: Array, orders: int) -> Array:
    """Sines and cosines of the harmonics of a phase in rad, (n, 2 * orders)."""
    waves = np.exp(1j * np.outer(phase, np.arange(1, orders + 1)))
    return np.stack([waves.imag, waves.real], axis=2).reshape(len(phase), -1)
