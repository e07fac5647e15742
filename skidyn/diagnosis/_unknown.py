# SPDX-License-Identifier: BSD-3-Clause
"""Description of an unknown effect: its variables, its shape, a formula."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis._proposal import Proposal, propose
from skidyn.diagnosis._variables import VariableTest, average_at_rows, depends_on
from skidyn.effects import NamelessEffect, Term, TermSum
from skidyn.evidence import Problem, jackknife, left_out_coefficients

#: Bins of a curve, and of each side of a map; a bin with fewer samples stays empty.
CURVE, MAP, FEWEST = 40, 16, 5


@dataclass(frozen=True)
class UnknownTorque:
    """An unknown torque on one joint.

    Parameters
    ----------
    joint : int
        Joint, counted from 1.
    variables : tuple of str
        Signals on which it depends according to the tests.
    tests : tuple of VariableTest
        The test of every signal.
    shape : dict
        ``variables`` (one or two), ``edges`` of the bins of each (SI units), and ``value``,
        ``low``, ``high``: torque in every bin with its 95 % band, N m or N; NaN in bins without
        samples.
    proposal : Proposal or None
        A short formula for it.

    Examples
    --------
    >>> diagnosis.unknowns[0].variables  # doctest: +SKIP
    ('q1', 'q3')
    """

    joint: int
    variables: tuple[str, ...]
    tests: tuple[VariableTest, ...]
    shape: dict[str, Any] = field(repr=False)
    proposal: Proposal | None

    def to_dict(self) -> dict[str, Any]:
        """As in the report file.

        Returns
        -------
        dict
            JSON types only.
        """
        shape = {
            key: _plain(value) if key != "variables" else list(value)
            for key, value in self.shape.items()
        }
        formula = None
        if self.proposal is not None:
            p = self.proposal
            formula = {
                "text": p.text,
                "expressions": list(p.expressions),
                "coefficients": list(p.coefficients),
                "share": p.share,
            }
        return {
            "joint": self.joint,
            "variables": list(self.variables),
            "tests": [asdict(t) for t in self.tests],
            "shape": shape,
            "formula": formula,
        }


def _plain(value: Any) -> Any:
    """Lists and numbers; None for NaN."""
    if isinstance(value, list | np.ndarray):
        return [_plain(v) for v in value]
    return None if np.isnan(value) else float(value)


def describe_unknowns(
    problem: Problem, terms: Sequence[Term], unknown: Sequence[Term], sigma: Array
) -> list[UnknownTorque]:
    """Variables, shape and formula of every unknown term.

    Parameters
    ----------
    problem : Problem
        Rows, folds and torque without ripple.
    terms : sequence of Term
        Every effect of the final model.
    unknown : sequence of Term
        The unknown ones among them.
    sigma : ndarray of shape (n_joints,)
        Noise of one row.
    """
    terms = list(terms)
    design = problem.design([problem.term_rows(t) for t in terms])
    target = problem.target
    whole, left = left_out_coefficients(problem, design, sigma, target, soft=problem.soft(terms))
    place = dict(TermSum(terms).slices(len(problem.rigid_index)))
    found = []
    for term in unknown:
        span = place[term]
        effect = term.effect
        assert isinstance(effect, NamelessEffect)
        guessed = effect.variables(term.places[0], dict(term.shape))
        # a force at the tool reaches joints that never slide, where no shape is determined
        places = [j for j in term.places if problem.rows.sliding[:, j].any()]
        # the position of the tool, and the recording, are not among the signals that are tested
        if "robot" in effect.needs or "trajectory" in guessed:
            for joint in places:
                own = guessed if "trajectory" in guessed else (f"q{joint + 1}",)
                shape = _shape(problem, term, joint, whole[span], left[:, span], own)
                found.append(UnknownTorque(joint + 1, guessed, (), shape, None))
            continue
        known = np.ones(len(whole), dtype=bool)
        known[span] = False
        for joint in places:
            without = _Remainder([d[:, known] for d in design], sigma, joint)
            rows = without(problem.term_rows(term)[joint])
            explained = rows @ whole[span]
            residual = target[joint] - design[joint] @ whole + explained
            in_time = _since_start(problem, joint) if _follows_start(term) else rows
            tests = depends_on(problem, joint, residual, guessed, in_time, without)
            needed = {t.variable for t in tests if t.needed}
            if effect.is_of_one_number or not needed:
                needed = set(guessed)
            variables = tuple(sorted(needed, key=lambda v: (v not in guessed, v)))
            shape = _shape(problem, term, joint, whole[span], left[:, span], variables)
            waves = _waves(term)
            proposal = propose(problem, joint, residual, explained, variables, waves, without)
            found.append(UnknownTorque(joint + 1, variables, tuple(tests), shape, proposal))
    return found


def _follows_start(term: Term) -> bool:
    """Whether a torque is a function of the time since the start of each recording, and others."""
    return "since_start" in (*term.shape.get("of", ()), term.shape.get("by"))


def _since_start(problem: Problem, joint: int) -> Array:
    """Time since the start at the rows of a joint, without its mean, (n_rows, 1), s."""
    since = average_at_rows(problem, joint, problem.signals.since_start)
    return np.asarray((since - since.mean())[:, None])


def _waves(term: Term) -> list[str]:
    """Expressions of a torque that is periodic in time."""
    if term.effect.search not in ("clock", "spectrum"):
        return []
    omega = 2 * np.pi * float(term.shape["frequency"])
    return [f"{wave}({omega:.9g} * t)" for wave in ("sin", "cos")]


class _Remainder:
    """Part of a torque on one joint that the known terms of a model cannot represent.

    The share of friction of a known kind in an unknown torque is not determined: only the residual
    after a fit of the known terms to it shows the missing effect (Frisch, Waugh 1933).
    """

    def __init__(self, known: Sequence[Array], sigma: Array, joint: int) -> None:
        self._own = known[joint] / sigma[joint] ** 2
        self._known = known[joint]
        gram = sum((d / s).T @ (d / s) for d, s in zip(known, sigma, strict=True) if len(d))
        self._inverse = np.linalg.pinv(np.asarray(gram), rcond=1e-12, hermitian=True)

    def __call__(self, columns: Array) -> Array:
        """Columns minus the part of known terms, shape as given."""
        mimic: Array = self._known @ (self._inverse @ (self._own.T @ columns))
        return columns - mimic


def _shape(
    problem: Problem,
    term: Term,
    joint: int,
    coefficients: Array,
    left: Array,
    variables: Sequence[str],
) -> dict[str, Any]:
    """Torque in bins of one or two signals, with a band from leaving folds out (jackknife)."""
    use = problem.rows.sliding[:, joint]
    columns = term.torque_columns(problem.signals)[joint][use]
    drawn = [v for v in variables if v != "time"][:2] or ["time"]
    n_bins = CURVE if len(drawn) == 1 else MAP
    index: NDArray[np.int64] = np.zeros(len(columns), dtype=np.int64)
    edges = []
    for name in drawn:
        x = problem.signals.named(name)[use]
        low, high = np.quantile(x, [0.005, 0.995])
        cuts = np.linspace(low, high, n_bins + 1)
        edges.append(cuts)
        place = np.clip(np.searchsorted(cuts, x) - 1, 0, n_bins - 1)
        index = (index * n_bins + place).astype(np.int64)
    size = n_bins ** len(drawn)
    count = np.bincount(index, minlength=size)
    mean = np.column_stack([np.bincount(index, c, minlength=size) for c in columns.T])
    average: Array = mean / np.maximum(count, 1)[:, None]
    value = average @ coefficients
    spread = jackknife(left @ average.T)
    empty = count < FEWEST

    def grid(x: Array) -> Array:
        return np.where(empty, np.nan, x).reshape((n_bins,) * len(drawn))

    return {
        "variables": tuple(drawn),
        "edges": edges,
        "value": grid(value),
        "low": grid(value - 1.96 * spread),
        "high": grid(value + 1.96 * spread),
    }
