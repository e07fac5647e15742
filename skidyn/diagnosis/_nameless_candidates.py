# SPDX-License-Identifier: BSD-3-Clause
"""Unknown functions as candidates, of signals on which the residual depends."""

from __future__ import annotations

from collections.abc import Collection

from skidyn._cores import each
from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._clock import LOWEST, slow_lines
from skidyn.diagnosis._followed_signals import Followed, followed_signals
from skidyn.diagnosis._hypothesis import UNKNOWN
from skidyn.diagnosis._spectrum import SLOWEST
from skidyn.effects import (
    ClockPeriodic,
    FunctionOfSignals,
    FunctionOfSum,
    NamelessEffect,
    ProductOfSignals,
    SizeByRecording,
    Term,
    get_effect,
    nameless_kinds,
)
from skidyn.evidence import Problem


def nameless_candidates(
    problem: Problem,
    residual: Array,
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
    followed_on : collection of int, optional
        Joints, from 0, for which only functions of signals found from the residual are made; by
        default all unknown functions of all joints.

    Returns
    -------
    list of Candidate
    """
    # slow to import, not needed to check a log, and before processes that would all import them
    import scipy.signal  # noqa: F401
    import sklearn.ensemble  # noqa: F401

    looked_at = range(problem.n_joints) if followed_on is None else followed_on

    def follow(j: int) -> Followed:
        return followed_signals(problem, j, residual[:, j])

    found = each(follow, looked_at)
    followed = dict(zip(looked_at, found, strict=True))
    few = problem.few
    made: list[tuple[Term, tuple[str, ...]]] = []
    among: dict[Term, int] = {}
    for kind in nameless_kinds():
        effect = get_effect(kind)
        assert isinstance(effect, NamelessEffect)
        for joints in effect.sites(few):
            joint = joints[0]
            if effect.search == "spectrum" or effect.not_shown(few, joint):
                continue
            if followed_on is not None and (effect.search != "screened" or joint not in followed):
                continue
            shapes = effect.grid(few, joints)
            if isinstance(effect, FunctionOfSignals):
                sets = [names for names in followed[joint].sets if effect.admits(names)]
                shapes = [effect.shape_of(few, names) for names in sets]
            if isinstance(effect, ProductOfSignals | SizeByRecording):
                if isinstance(effect, ProductOfSignals):
                    products = followed[joint].products
                    shapes = [effect.shape_of(factors) for factors, _ in products]
                else:
                    products, names = followed[joint].changing, problem.rows.recordings.tolist()
                    shapes = [effect.shape_of(factor, names) for (factor,), _ in products]
                among |= {
                    Term.at(kind, joints, shape): count
                    for shape, (_, count) in zip(shapes, products, strict=True)
                }
            if isinstance(effect, FunctionOfSum):
                shapes = [effect.shape_of(few, *of) for of in followed[joint].sums]
            if isinstance(effect, ClockPeriodic):
                shapes = slow_lines(
                    problem.signals,
                    residual[:, joint],
                    effect.carriers(problem.signals, joint),
                    problem.rows.sliding[:, joint],
                    (LOWEST, SLOWEST),
                )
            for shape in shapes:
                made.append((Term.at(kind, joints, shape), effect.variables(joint, shape)))
    all_rows = problem.prepare([term for term, _ in made], screening=True)
    return [
        Candidate(UNKNOWN, term, rows, names, len(term.effect.shapes), n_chosen=among.get(term, 1))
        for (term, names), rows in zip(made, all_rows, strict=True)
    ]
