# SPDX-License-Identifier: BSD-3-Clause
"""What the data could still hide: the largest magnitude of every effect that was not found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.stats import norm

from skidyn._signals import Array
from skidyn._text import inside
from skidyn.diagnosis._candidates import Candidate
from skidyn.effects import get_effect, list_effects
from skidyn.evidence import Normal, Problem, column_sizes

#: Chance of finding an effect of the stated magnitude.
POWER = 0.8
#: A column of which less than this share is new to the model cannot be told from it.
NEW_SHARE = 1e-4


@dataclass(frozen=True)
class Limit:
    """Largest magnitude of an effect that this data could hide.

    Parameters
    ----------
    kind : str
        Kind of the effect.
    joint : int
        Joint, counted from 1.
    largest_hidden : float or None
        Of the effect's first coefficient; None if the data cannot show the effect at all.
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


def find_limits(
    problem: Problem,
    candidates: Sequence[Candidate],
    blocks: Sequence[dict[int, Array]],
    sigma: Array,
    inflation: Array,
    least_gain: float,
) -> list[Limit]:
    """Limits of the effects on single joints that were tried and not found.

    Parameters
    ----------
    problem : Problem
        Rows.
    candidates : sequence of Candidate
        What was tried.
    blocks : sequence of dict
        Columns of the final model beside the rigid body.
    sigma, inflation : ndarray of shape (n_joints,)
        Noise of one row and its variance inflation.
    least_gain : float
        Twice the log-likelihood gain at which a finding is reported.

    Returns
    -------
    list of Limit
    """
    design = [a / s for a, s in zip(problem.design(blocks), sigma, strict=True)]
    gram = np.asarray(sum(a.T @ a for a in design))
    model = Normal(gram, np.zeros(len(gram)), column_sizes(gram))
    needed = np.sqrt(least_gain) + norm.ppf(POWER)
    power = [float(np.sum(t**2)) / s**2 for t, s in zip(problem.target, sigma, strict=True)]
    largest: dict[tuple[str, int], list[tuple[Candidate, float]]] = {}
    for candidate in candidates:
        effect = candidate.term.effect
        share = effect.coefficients[0].is_share
        if len(candidate.joints) != 1 or effect.nameless or share:
            continue
        joint = candidate.joints[0]
        own, swept = _information(candidate, design, sigma, model)
        size = needed * np.sqrt(inflation[joint] / swept) if swept > NEW_SHARE * own else np.inf
        # More than all that the torque holds is no limit.
        told = size if size**2 * own < power[joint] else np.inf
        largest.setdefault((effect.kind, joint), []).append((candidate, float(told)))
    limits = [_limit(problem, joint, tried) for (_, joint), tried in largest.items()]
    return sorted([*limits, *_not_shown(problem)], key=lambda limit: (limit.joint, limit.kind))


def _limit(problem: Problem, joint: int, tried: Sequence[tuple[Candidate, float]]) -> Limit:
    """The limit of one effect on one joint, which holds for every shape that would show."""
    effect = tried[0][0].term.effect
    first = effect.coefficients[0]
    unit = effect.units(bool(problem.signals.prismatic[joint])).get(first.name, first.unit)
    shown = [size for _, size in tried if np.isfinite(size)]
    if not shown:
        sentence = (
            f"This data cannot tell {inside(effect.title)} of joint {joint + 1} from what the "
            f"model has. It would show with {effect.separating_motion}."
        )
        return Limit(effect.kind, joint + 1, None, unit, sentence)
    most = f"{max(shown):.3g}{'' if unit == '1' else ' ' + unit}"
    sentence = (
        f"{effect.title} of joint {joint + 1}: not detected; {first.name} above {most} would have "
        "been found"
    )
    if hidden := _hidden_shapes(tried):
        values = ", ".join(f"{value:.3g}" for value in hidden)
        sentence += f"; with {effect.shapes[0].name} of {values} it would not show"
    return Limit(effect.kind, joint + 1, max(shown), unit, sentence + ".")


def _hidden_shapes(tried: Sequence[tuple[Candidate, float]]) -> list[float]:
    """Values of the first shape parameter with which an effect would not show at any size."""
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
    candidate: Candidate, design: Sequence[Array], sigma: Array, model: Normal
) -> tuple[float, float]:
    """Squared size of the first column before and after the model and the other columns."""
    z = {j: block / sigma[j] for j, block in candidate.rows.items()}
    cross = np.asarray(sum(design[j].T @ block for j, block in z.items()))
    own = np.asarray(sum(block.T @ block for block in z.values()))
    swept = own - cross.T @ model.solve(cross)
    if len(own) == 1:
        return float(own[0, 0]), float(max(swept[0, 0], 0.0))
    others = swept[1:, 1:] + 1e-9 * np.diag(np.diag(own)[1:] + 1e-300)
    rest = swept[0, 0] - swept[0, 1:] @ np.linalg.solve(others, swept[1:, 0])
    return float(own[0, 0]), float(max(rest, 0.0))


def _not_shown(problem: Problem) -> list[Limit]:
    """Effects whose signal is missing or does not vary."""
    limits = []
    for kind in list_effects():
        effect = get_effect(kind)
        if effect.scope != "joint":
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
