# SPDX-License-Identifier: BSD-3-Clause
"""Hypotheses of a search, their properties, and the result of the search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate
from skidyn.effects import Term, get_effect
from skidyn.evidence import Fit, Problem

UNKNOWN = "unknown"


@dataclass(frozen=True)
class Hypothesis:
    """A kind of effect on certain joints, as an explanation of the residual.

    Attributes
    ----------
    kind : str
        Kind, ``"unknown"`` for unknown functions.
    candidates : tuple of Candidate
        Its terms.
    gain : ndarray of shape (n_joints,)
        Twice the held-out log-likelihood gain by joint.
    score : float
        Gain minus the penalty for its parameters.
    n_parameters : int
        Coefficients and shape parameters.
    chances : tuple of float
        P-value of every term at its acceptance, in the order of the candidates.
    tried : float
        Number of candidates among which it was chosen.
    margin : float
        Margin over the best other explanation of the same joints, as a share of its gain.
    alike : bool
        Whether a kind that acts on other joints explains equally much, so that the data cannot
        separate them: for example a plane that a slider touches and the slider's own stop.
    elsewhere : tuple of tuple of int
        Other joints or pairs of joints, from 0, on which the same kind explains equally much.
    errors : ndarray of shape (n_folds, n_joints) or None
        Held-out squared error with it; None if it was judged by other means.
    torque : ndarray of shape (n_samples, n_joints) or None
        Torque to be subtracted at the full rate (ripple).
    others : tuple of Hypothesis
        Explanations of other kinds in its ranking when it was added, best first.
    alone : tuple of Hypothesis
        Those of its terms that have rivals on their own joint, each compared with these.
    """

    kind: str
    candidates: tuple[Candidate, ...]
    gain: Array
    score: float
    n_parameters: int
    chances: tuple[float, ...] = ()
    tried: float = 1
    margin: float = 1.0
    alike: bool = False
    elsewhere: tuple[tuple[int, ...], ...] = ()
    errors: Array | None = None
    torque: Array | None = None
    others: tuple[Hypothesis, ...] = ()
    alone: tuple[Hypothesis, ...] = ()

    @property
    def joints(self) -> tuple[int, ...]:
        """Joints of its terms, from 0."""
        return tuple(sorted({j for c in self.candidates for j in c.joints}))

    @property
    def is_further_form(self) -> bool:
        """Whether one of its terms is a further form of its effect, less simple than plain ones."""
        return any(c.is_further_form for c in self.candidates)

    @property
    def variables(self) -> tuple[str, ...]:
        """Signals of unknown functions."""
        return tuple(sorted({v for c in self.candidates for v in c.variables}))


@dataclass
class SearchResult:
    """Result of a search.

    Attributes
    ----------
    findings : list of Hypothesis
        Added kinds, in order.
    fit : Fit
        Last fit.
    ripple : ndarray of shape (n_samples, n_joints)
        Torque of the ripple found, N m.
    candidates : list of Candidate
        Known effects that were not found.
    n_tests : int
        Number of all candidates that were tried.
    doubted : tuple of Term
        Effects that were found and then withdrawn. What they explained is still in the log, without
        a name.
    """

    findings: list[Hypothesis]
    fit: Fit
    ripple: Array
    candidates: list[Candidate] = field(default_factory=list)
    n_tests: int = 1
    doubted: tuple[Term, ...] = ()


def ranked_with(best: Hypothesis, ranking: Sequence[Hypothesis]) -> Hypothesis:
    """The explanation that is added, with those of other kinds in its ranking."""
    return replace(best, others=tuple(h for h in ranking if h.kind != best.kind))


def least_sure(best: Hypothesis, joints: Sequence[int]) -> Hypothesis:
    """The explanation itself, or its term on some joints if this has a smaller margin alone."""
    alone = [h for h in best.alone if set(h.joints) <= set(joints)]
    return min([best, *alone], key=lambda h: h.margin)


def close_shapes(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether shape parameters are equal within a hundredth."""
    numbers = [(one[k], other[k]) for k in one if isinstance(one[k], float)]
    return all(np.isclose(a, b, rtol=0.01) for a, b in numbers)


def some_recordings(candidate: Candidate) -> bool:
    """Whether a candidate acts in some recordings only."""
    return candidate.term.trajectories is not None


def grouped_by_joints(candidates: Sequence[Candidate]) -> list[list[Candidate]]:
    """Candidates of the same joints together, in the order of their first ones."""
    parts: dict[tuple[int, ...], list[Candidate]] = {}
    for candidate in candidates:
        parts.setdefault(candidate.joints, []).append(candidate)
    return list(parts.values())


def is_vibration(hypothesis: Hypothesis) -> bool:
    """Whether it is a wave in time that no known effect causes."""
    return hypothesis.kind == UNKNOWN and hypothesis.torque is not None


def says_little(hypothesis: Hypothesis) -> bool:
    """Whether an explanation has the lowest priority: a vibration or differences between runs."""
    apart = hypothesis.kind == UNKNOWN and within_recordings(hypothesis)
    return is_vibration(hypothesis) or (apart and not in_part(hypothesis))


def in_part(hypothesis: Hypothesis) -> bool:
    """Whether a term of it acts in a part of the recordings that was found together with it."""
    return any(c.n_parts > 1 for c in hypothesis.candidates)


def within_recordings(hypothesis: Hypothesis) -> bool:
    """Whether a term of it acts in some recordings only, so that folds lie within recordings."""
    return any(map(some_recordings, hypothesis.candidates))


def terms_on_rows(findings: Sequence[Hypothesis]) -> list[Term]:
    """Terms of findings except lines of a spectrum, which are subtracted at every sample."""
    return [c.term for h in findings if h.torque is None for c in h.candidates]


def found_terms(problem: Problem, findings: Sequence[Hypothesis]) -> list[Term]:
    """Terms of findings, each once, without those of the given model."""
    terms = dict.fromkeys(c.term for h in findings for c in h.candidates)
    return [t for t in terms if t not in problem.terms]


def on_samples(term: Term) -> bool:
    """Whether a term is a line in a spectrum, which averaged rows do not contain."""
    return term.effect.search == "spectrum"


def rivals_among(best: Hypothesis, ranking: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Other explanations of the same joints, except members of the same family."""
    own = set(best.joints)
    return [
        h
        for h in ranking
        if h.kind != best.kind
        and own & set(h.joints)
        and not of_one_family(best, h)
        # Errors of single recordings are smaller.
        and (within_recordings(best) or not within_recordings(h))
        and not is_vibration(h)
    ]


def on_single_joints(hypothesis: Hypothesis) -> bool:
    """Whether it is a known effect on single joints, found on rows of all recordings."""
    return _acts_on(hypothesis, "joint")


def on_pairs(hypothesis: Hypothesis) -> bool:
    """Whether it is a coupling of pairs of joints, found on rows of all recordings."""
    return _acts_on(hypothesis, "pair")


def _acts_on(hypothesis: Hypothesis, scope: str) -> bool:
    if hypothesis.kind == UNKNOWN or within_recordings(hypothesis):
        return False
    effect = get_effect(hypothesis.kind)
    return hypothesis.torque is None and effect.scope == scope and effect.search == "grid"


def is_plain_friction(hypothesis: Hypothesis) -> bool:
    """Whether it is viscous or Coulomb friction, which every joint has, in all recordings."""
    if hypothesis.kind == UNKNOWN or within_recordings(hypothesis) or hypothesis.is_further_form:
        return False
    effect = get_effect(hypothesis.kind)
    return effect.is_exact and effect.drawn_against == "dq"


def margin_over(best: Hypothesis, rivals: Sequence[Hypothesis]) -> float:
    """Margin over the rivals, as a share of the best score."""
    if not rivals or best.score <= 0:
        return 1.0
    return 1.0 - max(h.score for h in rivals) / best.score


def removed_share(gain: Array, counts: NDArray[np.int64]) -> Array:
    """Share of the squared error that a gain removes, (n_joints,).

    Parameters
    ----------
    gain : ndarray of shape (n_joints,)
        Twice the log-likelihood gain by joint.
    counts : ndarray of shape (n_joints,)
        Averaged rows of every joint.

    Returns
    -------
    ndarray of shape (n_joints,)
        0 where the error grows.
    """
    return np.asarray(-np.expm1(-np.maximum(gain, 0.0) / np.maximum(counts, 1)))


def family_of(hypothesis: Hypothesis) -> str:
    """Family of its kind, empty for none."""
    return "" if hypothesis.kind == UNKNOWN else get_effect(hypothesis.kind).family


def of_one_family(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether the kinds of two explanations are members of one family."""
    return family_of(one) == family_of(other) != ""


def simplicity_of(hypothesis: Hypothesis) -> int:
    """Rank of its kind among equally good rivals; the lowest is preferred."""
    if hypothesis.kind == UNKNOWN:
        return 100
    ranks = [c.term.effect.simplicity_of(c.term.shape) for c in hypothesis.candidates]
    changes = any(c.term.course for c in hypothesis.candidates)
    return max(ranks) + 50 * (hypothesis.is_further_form or changes)


def uses_the_fit(candidate: Candidate) -> bool:
    """Whether its columns depend on the fit of the model."""
    effect = candidate.term.effect
    return effect.follows_fit and effect.search == "grid"
