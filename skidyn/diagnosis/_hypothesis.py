# SPDX-License-Identifier: BSD-3-Clause
"""What a search works with: hypotheses and what is asked of them, and its result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate
from skidyn.effects import Term, get_effect
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
    elsewhere : tuple of tuple of int
        Other pairs of joints, from 0, on which the same kind explains as much.
    errors : ndarray of shape (n_folds, n_joints) or None
        Held-out squared error with it; None where it was judged otherwise.
    torque : ndarray of shape (n_samples, n_joints) or None
        Torque to be taken off at the full rate (ripple).
    others : tuple of Hypothesis
        Explanations of other kinds that it was ranked with when it was added, best first.
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
    elsewhere: tuple[tuple[int, ...], ...] = ()
    errors: Array | None = None
    torque: Array | None = None
    others: tuple[Hypothesis, ...] = ()

    @property
    def joints(self) -> tuple[int, ...]:
        """Joints of its terms, from 0."""
        return tuple(sorted({j for c in self.candidates for j in c.joints}))

    @property
    def is_further_form(self) -> bool:
        """Whether a term of it is a further form of its effect: less simple than any plain one."""
        return any(c.is_further_form for c in self.candidates)

    @property
    def variables(self) -> tuple[str, ...]:
        """Signals of nameless functions."""
        return tuple(sorted({v for c in self.candidates for v in c.variables}))


@dataclass
class SearchResult:
    """What the search found.

    Attributes
    ----------
    findings : list of Hypothesis
        Added kinds, in order.
    fit : Fit
        Last fit.
    ripple : ndarray of shape (n_samples, n_joints)
        Torque of the ripple found, N m.
    candidates : list of Candidate
        Named effects that were not found.
    n_tests : int
        Everything that was tried.
    """

    findings: list[Hypothesis]
    fit: Fit
    ripple: Array
    candidates: list[Candidate] = field(default_factory=list)
    n_tests: int = 1


def ranked_with(best: Hypothesis, ranking: Sequence[Hypothesis]) -> Hypothesis:
    """The explanation that is added, which keeps those of other kinds in its ranking."""
    return replace(best, others=tuple(h for h in ranking if h.kind != best.kind))


def close_shapes(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether shape parameters are alike within a hundredth."""
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
    """Whether an explanation is one in name only: a vibration, or what differs between runs."""
    return is_vibration(hypothesis) or (
        hypothesis.kind == UNKNOWN and within_recordings(hypothesis)
    )


def within_recordings(hypothesis: Hypothesis) -> bool:
    """Whether a term of it acts in some recordings only, so that folds lie within recordings."""
    return any(map(some_recordings, hypothesis.candidates))


def terms_on_rows(findings: Sequence[Hypothesis]) -> list[Term]:
    """Terms of findings but lines of a spectrum, which are taken off at every sample."""
    return [c.term for h in findings if h.torque is None for c in h.candidates]


def rivals_among(best: Hypothesis, ranking: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Other explanations of the same joints, members of the same family apart."""
    own = set(best.joints)
    family = family_of(best)
    return [
        h
        for h in ranking
        if h.kind != best.kind
        and own & set(h.joints)
        and (not family or family_of(h) != family)
        # Errors of single recordings are smaller.
        and (within_recordings(best) or not within_recordings(h))
        and not is_vibration(h)
    ]


def margin_over(best: Hypothesis, rivals: Sequence[Hypothesis]) -> float:
    """Share of the best score by which the rivals fall short."""
    if not rivals or best.score <= 0:
        return 1.0
    return 1.0 - max(h.score for h in rivals) / best.score


def family_of(hypothesis: Hypothesis) -> str:
    """Family of its kind, empty for none."""
    return "" if hypothesis.kind == UNKNOWN else get_effect(hypothesis.kind).family


def simplicity_of(hypothesis: Hypothesis) -> int:
    """Rank of its kind among rivals that explain as much; the lower is named."""
    if hypothesis.kind == UNKNOWN:
        return 100
    return get_effect(hypothesis.kind).simplicity + 50 * hypothesis.is_further_form


def uses_the_fit(candidate: Candidate) -> bool:
    """Whether its columns follow the fit of the model that it is part of."""
    effect = candidate.term.effect
    return bool({"robot", "model_torque"} & set(effect.needs)) and effect.search == "grid"
