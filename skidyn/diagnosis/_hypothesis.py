# SPDX-License-Identifier: BSD-3-Clause
"""What a search works with: hypotheses, steps, and its result."""

from __future__ import annotations

from dataclasses import dataclass, field

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate
from skidyn.evidence import Fit

UNKNOWN = "unknown"


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
    chances : tuple of float
        Chance of every term at its acceptance, in the order of the candidates.
    tried : int
        Candidates among which it was chosen.
    margin : float
        Share of its gain that the best other explanation of the same joints falls short of.
    alike : bool
        Whether a kind that acts on other joints explains as much, so that nothing in the data tells
        them apart: a plane that a slider touches and the slider's own stop, for example.
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
    chances: tuple[float, ...] = ()
    tried: int = 1
    margin: float = 1.0
    alike: bool = False
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
    candidates : list of Candidate
        What was not found.
    n_tests : int
        Everything that was tried.
    """

    findings: list[Hypothesis]
    steps: list[Step]
    fit: Fit
    ripple: Array
    inflation: Array
    candidates: list[Candidate] = field(default_factory=list)
    n_tests: int = 1
