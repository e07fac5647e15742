# SPDX-License-Identifier: BSD-3-Clause
"""Unknown functions as candidates, of signals on which the residual depends."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

from skidyn._cores import each
from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._clock import LOWEST, slow_lines
from skidyn.diagnosis._followed_signals import Followed, followed_signals
from skidyn.diagnosis._hypothesis import UNKNOWN
from skidyn.diagnosis._rule import ROWS_PER_COEFFICIENT
from skidyn.diagnosis._spectrum import SLOWEST
from skidyn.effects import (
    ClockPeriodic,
    Effect,
    FunctionOfSignals,
    FunctionOfSum,
    NamelessEffect,
    ProductOfSignals,
    ProductWithFunction,
    ProductWithLoad,
    SizeByRecording,
    Term,
    get_effect,
    nameless_kinds,
)
from skidyn.evidence import Problem


def nameless_candidates(
    problem: Problem,
    residual: Array,
    absorbed: Sequence[Array],
    *,
    followed_on: Collection[int] | None = None,
) -> list[Candidate]:
    """Unknown functions of the signals for every joint.

    Parameters
    ----------
    problem : Problem
        Rows and folds.
    residual : ndarray of shape (n_samples, n_joints)
        Residual of the model, N m or N.
    absorbed : sequence of ndarray of shape (n_rows_j, k_j)
        Directions that the model takes in, as of
        :func:`~skidyn.diagnosis._absorbed.absorbed_directions`.
    followed_on : collection of int, optional
        Joints, from 0, for which only functions of signals found from the residual are made; by
        default all unknown functions of all joints.

    Returns
    -------
    list of Candidate
    """
    # slow to import, not needed to check a log, and before processes that would all import them
    import scipy.signal  # noqa: F401

    looked_at = range(problem.n_joints) if followed_on is None else followed_on
    effects = [e for e in map(get_effect, nameless_kinds()) if e.search != "spectrum"]

    def follow(j: int) -> tuple[Followed, dict[str, list[dict[str, Any]]]]:
        found = followed_signals(problem, j, residual[:, j], absorbed[j])
        if followed_on is not None:
            return found, {}
        return found, {e.kind: _waves(problem, e, j, residual) for e in effects}

    found = each(follow, looked_at)
    followed = dict(zip(looked_at, found, strict=True))
    made: list[tuple[Term, tuple[str, ...], int]] = []
    for effect in effects:
        assert isinstance(effect, NamelessEffect)
        for joints in effect.sites(problem.few):
            joint = joints[0]
            if effect.not_shown(problem.few, joint):
                continue
            if followed_on is not None and (effect.search != "screened" or joint not in followed):
                continue
            own, waves = followed[joint]
            free = problem.rows.counts[joint] - absorbed[joint].shape[1]
            shapes = _shapes(problem, effect, joints, own)
            shapes += [(shape, 1) for shape in waves.get(effect.kind, ())]
            for shape, among in shapes:
                term = Term.at(effect.kind, joints, shape)
                if term.width * ROWS_PER_COEFFICIENT <= free:
                    made.append((term, effect.variables(joint, shape), among))
    all_rows = problem.prepare([term for term, *_ in made], screening=True)
    return [
        Candidate(UNKNOWN, term, rows, names, len(term.effect.shapes), n_chosen=among)
        for (term, names, among), rows in zip(made, all_rows, strict=True)
    ]


def _shapes(
    problem: Problem,
    effect: NamelessEffect,
    joints: tuple[int, ...],
    followed: Followed,
) -> list[tuple[dict[str, Any], int]]:
    """Shapes of an effect that are tried, each with the number among which it was chosen."""
    few = problem.few
    if isinstance(effect, ProductOfSignals):
        return [(effect.shape_of(factors), among) for factors, among in followed.products]
    if isinstance(effect, ProductWithFunction):
        return [(effect.shape_of(few, factor, names), n) for factor, names, n in followed.partly]
    if isinstance(effect, ProductWithLoad):
        return [(effect.shape_of(factors), among) for factors, among in followed.loaded]
    if isinstance(effect, SizeByRecording):
        names = problem.rows.recordings.tolist()
        return [(effect.shape_of(of, names), among) for (of,), among in followed.changing]
    if isinstance(effect, FunctionOfSignals):
        shapes = [effect.shape_of(few, names) for names in followed.sets if effect.admits(names)]
    elif isinstance(effect, FunctionOfSum):
        shapes = [effect.shape_of(few, *of) for of in followed.sums]
    elif isinstance(effect, ClockPeriodic):
        shapes = []  # those of :func:`_waves`
    else:
        shapes = effect.grid(few, joints)
    return [(shape, 1) for shape in shapes]


def _waves(problem: Problem, effect: Effect, joint: int, residual: Array) -> list[dict[str, Any]]:
    """Shapes of an effect that is periodic in time on a joint; none of other effects."""
    if not isinstance(effect, ClockPeriodic) or effect.not_shown(problem.few, joint):
        return []
    return slow_lines(
        problem.signals,
        residual[:, joint],
        effect.carriers(problem.signals, joint),
        problem.rows.sliding[:, joint],
        (LOWEST, SLOWEST),
    )
