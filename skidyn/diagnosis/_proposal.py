# SPDX-License-Identifier: BSD-3-Clause
"""A short formula for an unknown torque: sparse regression over a small, safe grammar.

Products of a few functions of the positions and of the velocities that the torque depends on are
tried one by one, and the best is kept; then a second and a third (orthogonal matching pursuit),
judged by the error of the held-out folds.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from skidyn._signals import Array
from skidyn.diagnosis._pursuit import Products, pursue
from skidyn.effects import Term, formula
from skidyn.evidence import Problem

#: Most terms of a formula, and least share of the part explained by the unknown function.
LONGEST, LEAST_SHARE = 3, 0.9
#: Least share of it for a further term.
WORTH = 0.03
#: Least share (of squares) of an expression that known terms cannot represent.
_ABSORBED = 1e-4


@dataclass(frozen=True)
class Proposal:
    """A formula that explains the torque of an unknown function.

    Parameters
    ----------
    joint : int
        Joint on which the torque acts, counted from 1.
    text : str
        The formula with its coefficients, SI units.
    expressions : tuple of str
        Its terms without coefficients.
    coefficients : tuple of float
        Their coefficients, N m or N.
    share : float
        Squared error that it removes on held-out folds, relative to that of the unknown function.
    terms : tuple of Term
        Terms for a model.

    Examples
    --------
    >>> Proposal(2, "0.8 sin(q1 - q2)", ("sin(q1 - q2)",), (0.8,), 1.0, ()).text
    '0.8 sin(q1 - q2)'
    """

    joint: int
    text: str
    expressions: tuple[str, ...]
    coefficients: tuple[float, ...]
    share: float
    terms: tuple[Term, ...]


def grammar(variables: Sequence[str], joint: int) -> list[str]:
    """Expressions to try for a torque that depends on some signals.

    Parameters
    ----------
    variables : sequence of str
        Signals such as ``"q1"`` and ``"dq3"``.
    joint : int
        Joint on which the torque acts, from 0.
    """
    positions = [v for v in variables if v.startswith("q")]
    velocities = [v for v in variables if v.startswith("dq")]
    others = [v for v in variables if v.startswith("ddq")]
    places = [f(q) for q in positions for f in _PLACES]
    for a, b in itertools.combinations(positions, 2):
        places += [f"{w}({a} {o} {b})" for w in ("sin", "cos") for o in "-+"] + [f"{a} * {b}"]
    speeds = [f(v) for v in velocities for f in _SPEEDS]
    own = f"dq{joint + 1}"
    speeds += [f"{a} * {b}" for a, b in itertools.combinations(sorted(velocities), 2)]
    for a, b in itertools.permutations(velocities, 2):
        speeds += [f"{a} * abs({b})", f"sign({a}) * abs({b})", f"sign({a}) * {b}"]
    frictions = [own, f"sign({own})"] if own in velocities else speeds
    mixed = [f"{p} * {v}" for p in places for v in frictions if positions]
    return list(dict.fromkeys([*places, *speeds, *mixed, *others]))


_PLACES = (
    "{}".format,
    "{}**2".format,
    "{}**3".format,
    "sin({})".format,
    "cos({})".format,
    "sin(2 * {})".format,
    "cos(2 * {})".format,
    "sin(3 * {})".format,
    "cos(3 * {})".format,
)
_SPEEDS = (
    "{}".format,
    "sign({})".format,
    "abs({})".format,
    "{0} * abs({0})".format,
    "{}**3".format,
    "tanh(10 * {})".format,
)


def propose(
    problem: Problem,
    joint: int,
    residual: Array,
    explained: Array,
    variables: Sequence[str],
    waves: Sequence[str],
    without: Callable[[Array], Array],
) -> Proposal | None:
    """The shortest formula that explains an unknown function.

    Parameters
    ----------
    problem : Problem
        Rows and folds.
    joint : int
        Joint, from 0.
    residual : ndarray of shape (n_rows,)
        Residual rows of the joint including the unknown torque.
    explained : ndarray of shape (n_rows,)
        Rows of the unknown torque.
    variables : sequence of str
        Signals on which it depends.
    waves : sequence of str
        Expressions in time to try in addition.
    without : callable
        Function that removes from rows the part that known terms of the model can represent.

    Returns
    -------
    Proposal or None
        None if no short formula fits.
    """
    expressions = [*grammar(variables, joint), *waves]
    if not expressions:
        return None
    terms = [formula(e, joint + 1) for e in expressions]
    whole = np.hstack([problem.term_rows(t)[joint] for t in terms])
    columns = without(whole)
    size = [np.einsum("ij,ij->j", c, c) for c in (columns, whole)]
    columns[:, size[0] < _ABSORBED * size[1]] = 0.0
    fold = problem.fold[joint]
    nothing = float(residual @ residual)
    goal = max(nothing - float(np.sum((residual - explained) ** 2)), 1e-300)
    products = Products.of_columns(columns, residual, fold)
    chosen, reached = pursue(products, worth=WORTH * goal, longest=LONGEST)
    share = (nothing - reached) / goal
    if not chosen or share < LEAST_SHARE:
        return None
    coefficients = np.linalg.lstsq(columns[:, chosen], residual, rcond=None)[0]
    words = tuple(expressions[i] for i in chosen)
    parts = [f"{c:+.3g} {w}" for c, w in zip(coefficients, words, strict=True)]
    text = " ".join(parts).removeprefix("+")
    found = tuple(terms[i] for i in chosen)
    return Proposal(joint + 1, text, words, tuple(map(float, coefficients)), float(share), found)
