# SPDX-License-Identifier: BSD-3-Clause
"""Limits: the largest magnitude with which each effect could remain undetected."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from skidyn._cores import each
from skidyn._signals import Array
from skidyn._text import inside
from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._chance import degrees_of_freedom, least_significant
from skidyn.diagnosis._rule import ROUNDING, Settings
from skidyn.effects import get_effect, searched_kinds
from skidyn.evidence import (
    Felt,
    Normal,
    Problem,
    column_sizes,
    felt_columns,
    gram_of,
    products_with,
)

#: Probability of finding an effect of the stated magnitude.
POWER = 0.8
#: A column of which less than this share is new to the model cannot be separated from it.
NEW_SHARE = 1e-4


@dataclass(frozen=True)
class Limit:
    """Largest magnitude of an effect that could be present without being detected.

    Parameters
    ----------
    kind : str
        Kind of the effect.
    joint : int
        Joint, counted from 1.
    largest_hidden : float or None
        Magnitude of the effect's first coefficient; None if the data cannot show the effect at all.
    unit : str
        Its unit.
    sentence : str
        The same in words.

    Examples
    --------
    >>> Limit("dahl", 1, 0.4, "N m", "Dahl friction of joint 1: below 0.4 N m.").largest_hidden
    0.4
    """

    kind: str
    joint: int
    largest_hidden: float | None
    unit: str
    sentence: str

    def to_dict(self) -> dict[str, Any]:
        """As a dictionary for JSON.

        Returns
        -------
        dict
            One entry of ``limits``.
        """
        return asdict(self)


@dataclass(frozen=True)
class Gates:
    """Squared error of a joint that an effect must remove, in units of its noise.

    A limit is the size that passes every test of the rule, not only significance.

    Parameters
    ----------
    settings : Settings
        Thresholds of the search.
    n_tests : int
        Candidates tried.
    block : list of ndarray of shape (n_rows_j,)
        Block of time of the test in which every row lies, by joint.
    counts : ndarray of shape (n_joints,)
        Averaged rows.
    whiteness : ndarray of shape (n_joints,)
        Variance of a sample over that of an averaged row, to convert a share of the error of
        samples to rows.
    earlier : ndarray of shape (n_joints,)
        Squared error that earlier findings removed, in units of the remaining noise.
    """

    settings: Settings
    n_tests: int
    block: list[NDArray[np.int64]]
    counts: NDArray[np.int64]
    whiteness: Array
    earlier: Array

    def acting(self, joint: int, column: Array) -> float:
        """Degrees of freedom of the blocks in which a column acts on a joint.

        Parameters
        ----------
        joint : int
            Joint, from 0.
        column : ndarray of shape (n_rows_j,)
            What the model cannot represent of the column of an effect.
        """
        size = float(np.abs(column).max(initial=0.0))
        if not 0 < size < np.inf:
            return 1.0  # nothing of it is new to the model, but for rounding
        share = np.bincount(self.block[joint], (column / size) ** 2)
        return degrees_of_freedom(share[:, None, None] / share.sum())

    def needed(self, joint: int, n_parameters: int, inflation: float, free: float) -> float:
        """Size of a column relative to the noise with which the effect is found.

        Parameters
        ----------
        joint : int
            Joint, from 0.
        n_parameters : int
            Coefficients and shape parameters of the effect.
        inflation : float
            Variance inflation of the residual.
        free : float
            Degrees of freedom of the blocks in which the effect acts.
        """
        s = self.settings
        drop = max(
            inflation * least_significant(s.level / self.n_tests, free) ** 2,
            s.least_gain + 2 * inflation * n_parameters,
            float(s.least_share * self.counts[joint]),
            float(s.least_drop * self.whiteness[joint] * self.counts[joint]),
            float(s.form_tolerance * self.earlier[joint]),
        )
        return float(np.sqrt(drop) + ndtri(POWER) * np.sqrt(inflation))


def find_limits(
    problem: Problem,
    candidates: Sequence[Candidate],
    blocks: Sequence[dict[int, Array]],
    sigma: Array,
    inflation: Array,
    gates: Gates,
) -> list[Limit]:
    """Limits of the effects on single joints that were not found.

    Parameters
    ----------
    problem : Problem
        Rows.
    candidates : sequence of Candidate
        Candidates that were tried.
    blocks : sequence of dict
        Columns of the final model beside the rigid body.
    sigma, inflation : ndarray of shape (n_joints,)
        Noise of one row and its variance inflation.
    gates : Gates
        Squared error that an effect must remove to be a finding.
    """
    felt, width = felt_columns(problem, blocks, sigma)
    gram = gram_of(felt, width)
    model = Normal(gram, np.zeros(len(gram)), column_sizes(gram))
    power = [float(np.sum(t**2)) / s**2 for t, s in zip(problem.target, sigma, strict=True)]
    span = np.ptp(problem.torque, axis=0)

    @cache
    def needed(joint: int, count: int, free: int) -> float:
        return gates.needed(joint, count, float(inflation[joint]), free)

    def told(candidate: Candidate) -> float:
        (joint,) = candidate.joints
        own, swept, column = _information(candidate, felt, width, sigma, model)
        free = max(1, round(gates.acting(joint, column)))
        least = needed(joint, candidate.width + candidate.n_shapes, free)
        size = least / np.sqrt(swept) if swept > NEW_SHARE * own else np.inf
        # A size larger than the whole torque is not a limit, nor a torque beyond its range, of
        # which the motion contains a negligible part, nor a ratio to a load that is rounding error.
        unit = candidate.term.effect.coefficients[0].unit
        most = {"N m": span[joint], "1": 1 / ROUNDING}.get(unit, np.inf)
        return float(size if size**2 * own < power[joint] and size <= most else np.inf)

    single = [c for c in candidates if len(c.joints) == 1 and not c.term.effect.nameless]
    single = [c for c in single if not c.term.effect.coefficients[0].is_share]
    largest: dict[tuple[str, int], list[tuple[Candidate, float]]] = defaultdict(list)
    for candidate, size in zip(single, each(told, single), strict=True):
        largest[candidate.term.kind, candidate.joints[0]].append((candidate, size))
    limits = [_limit(problem, joint, tried) for (_, joint), tried in largest.items()]
    return sorted([*limits, *_not_shown(problem)], key=lambda limit: (limit.joint, limit.kind))


def _limit(problem: Problem, joint: int, tried: Sequence[tuple[Candidate, float]]) -> Limit:
    """The limit of one effect on one joint, valid for every detectable shape."""
    effect = tried[0][0].term.effect
    first = effect.coefficients[0]
    unit = effect.units(bool(problem.signals.prismatic[joint])).get(first.name, first.unit)
    shown = [size for _, size in tried if np.isfinite(size)]
    if not shown:
        sentence = (
            f"This data cannot separate {inside(effect.title)} of joint {joint + 1} from effects "
            f"that the model already has; a recording with {effect.separating_motion} would."
        )
        return Limit(effect.kind, joint + 1, None, unit, sentence)
    most = f"{max(shown):.3g}{'' if unit == '1' else ' ' + unit}"
    sentence = (
        f"{effect.title} of joint {joint + 1}: not detected; {first.name} above {most} would have "
        "been found"
    )
    if hidden := _hidden_shapes(tried):
        values = ", ".join(f"{value:.3g}" for value in hidden)
        sentence += f", except with {effect.shapes[0].name} of {values}"
    return Limit(effect.kind, joint + 1, max(shown), unit, sentence + ".")


def _hidden_shapes(tried: Sequence[tuple[Candidate, float]]) -> list[float]:
    """Values of the first shape parameter with which an effect cannot be detected at any size."""
    effect = tried[0][0].term.effect
    if not effect.shapes:
        return []
    name = effect.shapes[0].name
    sizes: dict[float, list[float]] = {}
    for candidate, size in tried:
        if name in candidate.term.shape:
            sizes.setdefault(float(candidate.term.shape[name]), []).append(size)
    return sorted(value for value, some in sizes.items() if not np.isfinite(some).any())


def _information(
    candidate: Candidate, felt: Sequence[Felt], width: int, sigma: Array, model: Normal
) -> tuple[float, float, Array]:
    """Squared size of the first column before and after elimination of the other columns.

    Also what is left of it on the rows of its joint.
    """
    (joint,) = candidate.joints
    z = {j: block / sigma[j] for j, block in candidate.rows.items()}
    cross = products_with(felt, z, width)
    own = np.asarray(sum(block.T @ block for block in z.values()))
    mimic = model.solve(cross)
    swept = own - cross.T @ mimic
    rows = z[joint] - felt[joint].rows @ mimic[felt[joint].places]
    if len(own) == 1:
        return float(own[0, 0]), float(max(swept[0, 0], 0.0)), rows[:, 0]
    others = swept[1:, 1:] + 1e-9 * np.diag(np.diag(own)[1:] + 1e-300)
    along = np.linalg.solve(others, swept[1:, 0])
    rest = float(max(swept[0, 0] - swept[0, 1:] @ along, 0.0))
    return float(own[0, 0]), rest, rows[:, 0] - rows[:, 1:] @ along


def without_withdrawn(limits: Sequence[Limit], withdrawn: Sequence[Candidate]) -> list[Limit]:
    """Limits without those of effects that were found and withdrawn because they remove too little.

    Parameters
    ----------
    limits : sequence of Limit
        All limits.
    withdrawn : sequence of Candidate
        Candidates that were withdrawn.

    Returns
    -------
    list of Limit
        Limits without the effects that were withdrawn.
    """
    taken = {(c.kind, j + 1) for c in withdrawn for j in c.joints}
    return [
        replace(
            limit,
            largest_hidden=None,
            sentence=f"The data shows a trace of {inside(get_effect(limit.kind).title)} on joint "
            f"{limit.joint}, which removes too little error to be a finding; no limit is stated "
            "for it.",
        )
        if (limit.kind, limit.joint) in taken
        else limit
        for limit in limits
    ]


def _not_shown(problem: Problem) -> list[Limit]:
    """Effects whose signal is missing or does not vary."""
    limits = []
    for kind in searched_kinds():
        effect = get_effect(kind)
        if effect.scope != "joint" or effect.of_servo:
            continue
        for joint in range(problem.n_joints):
            reason = effect.not_shown(problem.signals, joint)
            if reason:
                unit = effect.units(bool(problem.signals.prismatic[joint]))
                sentence = (
                    f"This data cannot show {inside(effect.title)} of joint {joint + 1}: {reason}."
                )
                first = effect.coefficients[0]
                text = unit.get(first.name, first.unit)
                limits.append(Limit(kind, joint + 1, None, text, sentence))
    return limits
