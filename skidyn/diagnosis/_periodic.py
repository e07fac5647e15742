# SPDX-License-Identifier: BSD-3-Clause
"""Ripple whose waves have another form than a sine, as of teeth and of cams."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from skidyn._signals import Array
from skidyn.diagnosis._spectrum import HIGHEST, PLACES, Line, tested_line
from skidyn.effects import Term
from skidyn.evidence import Problem

#: Number of harmonics of a wave.
HARMONICS = 5
#: Fewest waves within the motion, of which fewer can represent any function of the position, and
#: most, of which more are lines in a spectrum; step between those that are tried.
FEWEST, MOST, STEP = 2.5, 24.0, 0.1
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
        waves = _best_waves(q[use], r[use])
        if waves is None:
            continue
        term = Term.at("torque_ripple", (joint,), {"N": waves, "harmonics": float(HARMONICS)})
        line = tested_line(problem, term, 0.0, 2 * HIGHEST, use, r, fold)
        if significant(line.chance):
            found.append(line)
    return found


def _best_waves(q: Array, r: Array) -> float | None:
    """Waves per rad, or per m, that explain most of a residual; None if they explain little."""
    low, span = float(q.min()), float(np.ptp(q))
    bins = np.minimum(((q - low) / span * PLACES).astype(int), PLACES - 1)
    count = np.bincount(bins, minlength=PLACES)
    held = count > 0
    # positions between 0 and 1, of which the waves are counted
    x = (np.bincount(bins, q, PLACES)[held] / count[held] - low) / span
    weight = np.sqrt(count[held])
    y = np.bincount(bins, r, PLACES)[held] / weight
    smooth = np.column_stack([np.ones_like(x), x, np.sin(span * x), np.cos(span * x)])

    def left(waves: float) -> float:
        block = np.column_stack([smooth, harmonics(2 * np.pi * waves * x)]) * weight[:, None]
        return float(np.sum((y - block @ np.linalg.lstsq(block, y, rcond=None)[0]) ** 2))

    tried = np.arange(FEWEST, MOST, STEP)
    errors: NDArray[np.float64] = np.array([left(waves) for waves in tried])
    best = float(tried[int(np.argmin(errors))])
    bounds = max(FEWEST, best - STEP), best + STEP
    refined = minimize_scalar(left, bounds=bounds, method="bounded")
    if float(refined.fun) > (1 - LEAST_SHARE) * float(r @ r):
        return None
    return float(refined.x) * 2 * np.pi / span


def harmonics(phase: Array) -> Array:
    """Sines and cosines of the harmonics of a phase in rad, (n, 2 * 5)."""
    waves = np.exp(1j * np.outer(phase, np.arange(1, HARMONICS + 1)))
    return np.stack([waves.imag, waves.real], axis=2).reshape(len(phase), -1)
