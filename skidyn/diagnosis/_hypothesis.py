# SPDX-License-Identifier: BSD-3-Clause
"""What a search works with: thresholds, hypotheses, steps, and its result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate
from skidyn.evidence._problem import Fit, Problem

UNKNOWN = "unknown"


@dataclass(frozen=True)
class Settings:
    """Thresholds of the search; the defaults are what is shipped, for every robot and effect.

    Parameters
    ----------
    significance : float
        Chance of a false candidate over the whole catalogue (Bonferroni).
    relative_gate : float
        A drop of squared error smaller than this share is no finding.
    agreeing_folds : float
        Share of folds in which a candidate must lower the error.
    least_gain : float
        Least penalised gain of a finding (twice a log-likelihood).
    least_chance : float
        A finding must have a coefficient that differs from zero when folds are left out (jackknife,
        Student's t), at this level,
    sure_gain, weak_chance : float
        or, if its penalised gain is less than the first, at this one.
    second_same, second_any : float
        A later finding must bring this share of the first one's gain, on the same joints or
        anywhere: what is smaller is mostly the first effect's imperfect shape.
    unknown_handicap : float
        Share by which a nameless function must beat a named effect.
    simpler_share : float
        A simpler kind is named if it falls behind by less than this share.
    family_share : float
        Within a family of effects (hysteresis), the simplest one with this share of the best
        one's score is named.
    ripple_share : float
        Torque ripple must do this share of what a function of the signals does on averaged rows.
    max_findings : int
        Kinds added at most.
    finalists : int
        Kinds compared with noise re-estimated.
    refined : int
        So many of them with their shape parameters refined.

    Examples
    --------
    >>> Settings(max_findings=1).max_findings
    1
    """

    significance: float = 1e-4
    relative_gate: float = 0.003
    agreeing_folds: float = 0.5
    least_gain: float = 55.0
    least_chance: float = 0.01
    sure_gain: float = 220.0
    weak_chance: float = 0.0015
    second_same: float = 0.06
    second_any: float = 0.015
    unknown_handicap: float = 0.03
    simpler_share: float = 0.05
    family_share: float = 0.95
    ripple_share: float = 0.8
    max_findings: int = 4
    finalists: int = 8
    refined: int = 4


@dataclass(frozen=True)
class Hypothesis:
    """A kind of effect on certain joints, as an explanation of the residual.

    Attributes
    ----------
    kind : str
        Kind, ``"unknown"`` for nameless functions.
    candidates : tuple of Candidate
        Its terms.
    gain : ndarray of shape (n_joints,)
        Twice the held-out log-likelihood gain by joint.
    score : float
        Gain less the price of its parameters.
    n_parameters : int
        Coefficients and shape parameters.
    errors : ndarray of shape (n_folds, n_joints) or None
        Held-out squared error with it; None where it was judged otherwise.
    torque : ndarray of shape (n_samples, n_joints) or None
        Torque to be taken off at the full rate (ripple).
    """

    kind: str
    candidates: tuple[Candidate, ...]
    gain: Array
    score: float
    n_parameters: int
    errors: Array | None = None
    torque: Array | None = None

    @property
    def joints(self) -> tuple[int, ...]:
        """Joints of its terms, from 0."""
        return tuple(sorted({j for c in self.candidates for j in c.joints}))

    @property
    def variables(self) -> tuple[str, ...]:
        """Signals of nameless functions."""
        return tuple(sorted({v for c in self.candidates for v in c.variables}))


@dataclass
class Step:
    """One step of the search: the ranked explanations and the one that was added."""

    ranking: list[Hypothesis]
    added: Hypothesis | None


@dataclass
class SearchResult:
    """What the search found.

    Attributes
    ----------
    findings : list of Hypothesis
        Added kinds, in order.
    steps : list of Step
        Every step with its ranking.
    fit : Fit
        Last fit.
    ripple : ndarray of shape (n_samples, n_joints)
        Torque of the ripple found, N m.
    inflation : ndarray of shape (n_joints,)
        Variance inflation by the residual's autocorrelation.
    """

    findings: list[Hypothesis]
    steps: list[Step]
    fit: Fit
    ripple: Array
    inflation: Array
    candidates: list[Candidate] = field(default_factory=list)


def variance_inflation(problem: Problem, residual: Sequence[Array], lags: int = 12) -> Array:
    """How much more a slow column's coefficient varies than with independent rows, by joint.

    One plus twice the sum of the residual's autocorrelations up to the first small one.

    Parameters
    ----------
    problem : Problem
        Rows.
    residual : sequence of ndarray
        Residual rows of every joint.
    lags : int, default=12
        Largest lag in rows.

    Returns
    -------
    ndarray of shape (n_joints,)
    """
    inflation = np.ones(problem.n_joints)
    for j, r in enumerate(residual):
        power, lagged = 1e-30, np.zeros(lags)
        for name in np.unique(problem.rows.trajectory[j]):
            x = r[problem.rows.trajectory[j] == name]
            power += x @ x
            for lag in range(1, min(lags, len(x))):
                lagged[lag] += x[:-lag] @ x[lag:]
        for rho in lagged[1:] / power:
            if rho < 0.05:
                break
            inflation[j] += 2 * rho
    return inflation
