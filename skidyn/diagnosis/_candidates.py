# SPDX-License-Identifier: BSD-3-Clause
"""Candidates: terms of the catalogue, and unknown functions of the signals, with their rows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, Signals
from skidyn.diagnosis._rule import NEGLIGIBLE
from skidyn.effects import Term, get_effect
from skidyn.evidence import Problem


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect that may be missing.

    Attributes
    ----------
    kind : str
        Kind of the effect, ``"unknown"`` for an unknown function.
    term : Term
        Term that would be added.
    rows : dict of int to ndarray of shape (n_rows_j, n_coefficients)
        Averaged columns, per joint on which it acts.
    variables : tuple of str
        Signals on which an unknown function depends.
    n_shapes : int
        Shape parameters that are refined; they count as parameters.
    n_parts : float
        Number of parts of the recordings among which its own was chosen.
    n_chosen : int
        Number of products, or of functions of signals, of which it was the best.
    """

    kind: str
    term: Term
    rows: dict[int, Array]
    variables: tuple[str, ...] = ()
    n_shapes: int = 0
    n_parts: float = 1.0
    n_chosen: int = 1

    @cached_property
    def width(self) -> int:
        """Number of coefficients."""
        return self.term.width

    @cached_property
    def lowest(self) -> Array:
        """Smallest physically possible value of every coefficient."""
        return self.term.lowest

    @cached_property
    def zeros(self) -> NDArray[np.bool_]:
        """Coefficients that only define the zero of the effect."""
        return self.term.zeros

    @cached_property
    def limits(self) -> Array:
        """Largest magnitude of every coefficient at which the formula holds."""
        return self.term.limits

    @cached_property
    def is_further_form(self) -> bool:
        """Whether the formula differs from the plain one of its kind."""
        return self.term.is_further_form

    @cached_property
    def form(self) -> frozenset[str]:
        """Names of the shape entries by which its formula differs from the plain one."""
        return self.term.effect.form_names & set(self.term.shape)

    def allows(self, coefficients: Array) -> bool:
        """Whether coefficients are physically possible; negligible ones may have any sign.

        Parameters
        ----------
        coefficients : ndarray of shape (n_coefficients,)
            Fitted values.

        Returns
        -------
        bool
        """
        size = np.asarray(sum(np.sqrt(np.sum(rows**2, axis=0)) for rows in self.rows.values()))
        nothing = NEGLIGIBLE * float(np.abs(coefficients * size).max())
        bounded = np.isfinite(self.lowest)
        short = (self.lowest - coefficients)[bounded] * size[bounded]
        return not np.any(short > nothing)

    def can_have(self, coefficients: Array, signals: Signals) -> bool:
        """Whether coefficients are allowed, and those of this effect rather than of another one.

        Parameters
        ----------
        coefficients : ndarray of shape (n_coefficients,)
            Fitted values.
        signals : Signals
            Motion and robot.

        Returns
        -------
        bool
        """
        term = self.term
        return self.allows(coefficients) and term.effect.can_have(coefficients, term.shape, signals)

    @cached_property
    def joints(self) -> tuple[int, ...]:
        """Joints of the term, from 0."""
        return self.term.places

    @cached_property
    def site(self) -> tuple[str, tuple[int, ...]]:
        """Kind and joints, which can be added once."""
        return self.kind, self.joints


def rows_together(candidates: Sequence[Candidate], counts: NDArray[np.int64]) -> dict[int, Array]:
    """Averaged columns of several candidates side by side, per joint on which any of them acts.

    Parameters
    ----------
    candidates : sequence of Candidate
        Terms.
    counts : ndarray of shape (n_joints,)
        Rows of every joint.
    """
    reached = sorted({j for c in candidates for j in c.rows})

    def block(candidate: Candidate, joint: int) -> Array:
        return candidate.rows.get(joint, np.zeros((int(counts[joint]), candidate.width)))

    return {j: np.hstack([block(c, j) for c in candidates]) for j in reached}


def rows_within(
    problem: Problem, rows: Mapping[int, Array], recordings: Iterable[int]
) -> dict[int, Array]:
    """Averaged columns that are zero outside some recordings; windows do not cross their borders.

    Parameters
    ----------
    problem : Problem
        Rows.
    rows : mapping of int to ndarray of shape (n_rows_j, k)
        Columns in all recordings, per joint that they reach.
    recordings : iterable of int
        Numbers of trajectories.
    """
    own = list(recordings)
    return {
        j: np.where(np.isin(problem.rows.trajectory[j], own)[:, None], block, 0.0)
        for j, block in rows.items()
    }


def side_by_side(blocks: Sequence[Array]) -> Array:
    """All columns of some blocks, one after the other, shape (n_columns, n_rows).

    Many narrow blocks are copied several times faster so than next to each other.

    Parameters
    ----------
    blocks : sequence of ndarray of shape (n_rows, k)
        Blocks of columns.
    """
    return np.concatenate([block.T for block in blocks])


def catalogue_candidates(
    problem: Problem, kinds: Iterable[str], size_share: float = 0.0
) -> list[Candidate]:
    """Terms on the grid of every kind that the data can show and the model does not have.

    Parameters
    ----------
    problem : Problem
        Problem with the load and model torque of the current fit.
    kinds : iterable of str
        Kinds of the catalogue.
    size_share : float, default=0
        Least size of a coefficient, as a share of that implied by its shape.
    """
    present = {(term.kind, term.places) for term in problem.terms}
    few = problem.few
    terms: list[Term] = []
    for kind in kinds:
        effect = get_effect(kind)
        fixed = not problem.rigid_body or not effect.is_body
        if effect.search == "trajectories" and fixed and problem.robot is not None:
            # Identified bodies take in a permanent load; those of the URDF do not.
            joints = tuple(range(problem.n_joints))
            terms += [Term.at(kind, joints, shape) for shape in effect.grid(few, joints)]
            continue
        if effect.search != "grid" or ("robot" in effect.needs and problem.robot is None):
            continue
        if "load" in effect.needs and problem.robot is None:
            continue
        for joints in effect.sites(few):
            hidden = [effect.not_shown(few, j) for j in joints]
            # An effect of the whole robot can be detected if one joint shows it.
            if (kind, joints) in present or all(hidden) or (len(joints) < 3 and any(hidden)):
                continue
            grid = effect.grid(few, joints)
            if size_share:
                grid = [effect.bounded(few, joints, s, size_share) for s in grid]
            terms += [Term.at(kind, joints, shape) for shape in grid]
    # Data shared by kinds with the same needs is cached for one joint at a time.
    own = [*problem.terms, *terms]  # those of the model may depend on the load of the fit, too
    ordered = sorted(own, key=lambda term: (term.effect.needs, term.places))
    problem.prepare(ordered, text="Preparing effects")
    return [Candidate(t.kind, t, problem.term_rows(t), n_shapes=_refined(t)) for t in terms]


def _refined(term: Term) -> int:
    """Shape parameters that are refined."""
    if term.effect.search == "trajectories":
        return 0
    return sum(shape.name in term.shape for shape in term.effect.shapes)
