# SPDX-License-Identifier: BSD-3-Clause
"""Scales of torques, refined together with common bodies of all joints.

The ratio of a torque to that of the stated bodies gives its scale with the relative error of these
bodies. Joints that move the same bodies determine relative scales far better, so bodies near the
description and scales are found together, with a load that may differ from recording to recording.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._fits import Fits, friction
from skidyn.measurement._loads import by_recording
from skidyn.measurement._near_bodies import ExtraColumns, Factored, NearBodies, likely_load
from skidyn.measurement._peak import climb
from skidyn.measurement._reading import Reading
from skidyn.measurement._robust import fit_admissible

#: Most steps, the largest one, and the one that ends them.
STEPS, FARTHEST, CLOSE = 8, 0.3, 1e-3
#: Relative uncertainty of bodies, so that scales follow from common bodies of joints and not from
#: errors of bodies.
SHARE = 1.0
#: How far a scale may be from that of the stated bodies, as a share of it (one standard deviation).
KNOWN_TO = 0.5
#: Standard errors, and share, up to which a factor is the round number that it is near, and up to
#: which factors of several torques are the same where they are known to a tenth; standard errors
#: up to which one that is not may be the same.
ROUND, NEARLY, ALIKE, KNOWN, FAR = 1.5, 0.01, 0.1, 0.1, 3.0
#: Multiples of the robot's own torque that may be due to wrong masses.
USUAL = (0.4, 2.5)
#: Multiples that are attributed to wrong masses unless the other joints contradict.
CLEARLY = (0.62, 1.6)
#: Least share of a torque's spread that the robot must explain for its multiple to be known.
EXPLAINED = 0.5
AS_IT_IS = Reading()


@dataclass(frozen=True)
class Scales:
    """Scales of torques with their standard errors.

    Attributes
    ----------
    gains : dict of int to float
        Ratio of each torque to that of the robot, by joint from 0.
    errors : dict of int to float
        Standard errors of their logarithms; where all torques are at another scale, against their
        mean.
    """

    gains: dict[int, float]
    errors: dict[int, float]

    @property
    def factors(self) -> dict[int, float]:
        """Factors that remove the scales; one for all if they do not differ.

        A nearby round number is used for a single one that is not known better.
        """
        logs = np.log([self.gains[k] for k in self.gains])
        errors = np.array([self.errors[k] for k in self.gains]) + 1e-4
        weight = errors**-2 / np.sum(errors**-2)
        common = float(weight @ logs)
        apart, known = np.abs(logs - common), errors < KNOWN
        # that torques of several joints are all within a tenth by chance is unlikely
        if known.sum() > 1 and np.all(apart < np.where(known, ALIKE, FAR * errors)):
            one = _rounded(float(np.exp(-common)), float(np.sum(errors**-2) ** -0.5))
            return dict.fromkeys(self.gains, one)
        if len(logs) > 1:  # their ratios are known better than any of them
            return {k: float(f"{1 / gain:.4g}") for k, gain in self.gains.items()}
        return {k: _rounded(1 / gain, self.errors[k]) for k, gain in self.gains.items()}


def refined_scales(fits: Fits, gains: Mapping[int, float], free: Mapping[int, float]) -> Scales:
    """Scales of some torques with which bodies near those stated explain all torques best.

    Parameters
    ----------
    fits : Fits
        Rows.
    gains : mapping of int to float
        Scale of every torque whose scale is known, by joint from 0.
    free : mapping of int to float
        Scales that are refined, as far as they are known; the torques of other joints are at those
        of ``gains``.
    """
    fits = fits.with_loads(False)  # which are columns of their own here
    inflation = fits.identified(Reading()).inflation
    now = np.ones(fits.n_joints)
    for k, gain in {**gains, **free}.items():
        now[k] = gain
    joints = [k for k in free if fits.usable(k)]
    near = NearBodies(fits, Reading(), np.ones(fits.n_joints), inflation)
    torques = [fits.mean_torque(k)[0][use] for k, use in zip(near.joints, near.rows, strict=True)]
    stated = [y - target for y, target in zip(torques, near.targets, strict=True)]
    loads = _loads(fits, near)
    n_loads = loads[near.joints[0]].shape[1] if near.joints else 0
    precision = np.append(np.ones(n_loads), np.full(len(joints), KNOWN_TO**-2))
    errors = np.full(len(joints), KNOWN_TO)
    for _ in range(STEPS if joints else 0):
        near.targets = [
            y / now[k] - x for k, y, x in zip(near.joints, torques, stated, strict=True)
        ]
        known = ExtraColumns(loads, (), precision[:n_loads]) if n_loads else None
        plain = near.fit_to(SHARE, known).coefficients
        columns: dict[int, Array] = {}
        for j, d, p, x, use in zip(
            near.joints, near.designs, near.places, stated, near.rows, strict=True
        ):
            own = np.zeros((fits.n_rows, len(joints)))
            if j in joints:  # what bodies make, and not friction, that is free in any case
                bodies = p < near.n_bodies
                own[use, joints.index(j)] = x + d[:, bodies] @ plain[p[bodies]]
                own[use, joints.index(j)] += loads[j][use] @ plain[len(plain) - n_loads :]
            columns[j] = np.hstack([loads[j], own])
        found = near.fit_to(SHARE, ExtraColumns(columns, (), precision))
        change = found.coefficients[-len(joints) :]
        spread = Factored(found.gram).solve(np.eye(len(found.gram))[:, -len(joints) :])
        errors = np.sqrt(np.maximum(np.diag(spread[-len(joints) :]), 0.0))
        now[joints] *= 1 + np.clip(change, -FARTHEST, FARTHEST)
        if np.abs(change).max() < CLOSE:
            break
    if joints and set(joints) == set(near.joints):  # only stated bodies know all of them together
        cov = spread[-len(joints) :]
        mean = 1 / np.diag(cov) / np.sum(1 / np.diag(cov))
        against = np.eye(len(joints)) - mean
        errors = np.sqrt(np.maximum(np.diag(against @ cov @ against.T), 0.0))
        now[joints] *= _middle(np.array([free[k] / now[k] for k in joints]), errors**-2)
    sure = dict(zip(joints, errors.tolist(), strict=True))
    return Scales({k: float(now[k]) for k in free}, {k: float(sure.get(k, KNOWN_TO)) for k in free})


def _middle(values: Array, weights: Array) -> float:
    """Weighted median: the scale of a joint that is hardly known counts little."""
    order = np.argsort(values)
    share = np.cumsum(weights[order]) / weights.sum()
    return float(values[order][np.searchsorted(share, 0.5)])


def _loads(fits: Fits, near: NearBodies) -> dict[int, Array]:
    """Columns of a load on the last body that differs from recording to recording, by joint.

    A payload of one recording would otherwise be scales of the joints that carry it.
    """
    size = likely_load(fits.robot)
    last = np.arange(near.n_bodies - len(size), near.n_bodies)
    load = fits.mean_regressor(fits.robot, Reading().motion(fits.signals), last) * size
    return {j: by_recording(load[:, j], fits.recording) for j in near.joints}


def _rounded(factor: float, error: float) -> float:
    """A factor, or an equally likely number of two digits or its reciprocal."""
    near = (float(f"{factor:.2g}"), 1 / float(f"{1 / factor:.2g}"))
    best = min(near, key=lambda x: abs(x / factor - 1))
    within = abs(best / factor - 1) < min(NEARLY, ROUND * error)
    return float(f"{best:.6g}" if within else f"{factor:.4g}")


def scale_gain(fits: Fits, k: int, gain: float) -> float:
    """Log-likelihood gain of another scale of one torque, with bodies that all joints share."""
    other = fits.scaled({k: gain}).identified(Reading())
    # the density of a torque is that of the scaled torque divided by the gain
    change = other.margin(fits.identified(Reading()))
    rows = float(fits.moving[:, k].sum())
    change[k] -= rows * np.log(gain) / other.inflation_of(k)
    return float(change.sum())


def spring_gain(fits: Fits, k: int) -> float:
    """Log-likelihood gain of any slow function of its position on a joint, beside its bodies.

    A spring or a counterweight that is missing changes a torque as another scale does. The gain is
    that without the penalty for its numbers (Schwarz 1978).
    """
    there, here = fits.with_a_spring(k), fits.identified(Reading())
    numbers = len(there.fits[k].coefficients) - len(here.fits[k].coefficients)
    rows = float(fits.moving[:, k].sum()) / there.inflation_of(k)
    return float(there.gained_over(here) - 0.5 * numbers * np.log(max(rows, 2.0)))


def joint_gain(fits: Fits, k: int, gain: float) -> tuple[float, float]:
    """Scale of one torque at which identified bodies, which all joints share, explain it best.

    Parameters
    ----------
    fits : Fits
        Rows.
    k : int
        Joint, from 0.
    gain : float
        Ratio of its torque to that of the stated bodies.

    Returns
    -------
    gain, gained : float
        Scale, and its log-likelihood gain over none.
    """

    @cache  # a search comes back to where it was
    def at(place: float) -> float:
        return scale_gain(fits, k, float(np.exp(np.log(gain) + 0.01 * place)))

    step = 8  # maxima are narrow if the noise is small
    first = max(range(-5 * step, 6 * step, step), key=lambda place: (at(place), place))
    place, best = climb(at, first, step, 0.5)
    return float(np.exp(np.log(gain) + 0.01 * place)), best


def known_gains(fits: Fits, reading: Reading = AS_IT_IS) -> dict[int, float]:
    """Multiple of the robot's own torque, for columns of which it explains enough."""
    here = fits.nominal(reading)
    s = reading.motion(fits.signals)
    known = {}
    for k in range(fits.n_joints):
        if not fits.usable(k) or not here.gain[k] > 0:
            continue
        y, use = fits.mean_torque(k)
        bare = fit_admissible(fits.average(friction(s, k))[use], y[use])
        if here.scale[k] ** 2 < (1 - EXPLAINED) * bare.scale**2 * (1 - EXPLAINED):
            known[k] = float(here.gain[k])
    return known
