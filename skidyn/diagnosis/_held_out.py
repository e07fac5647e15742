# SPDX-License-Identifier: BSD-3-Clause
"""Residual of every sample under a model fitted without its fold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.diagnosis._rule import CONFINED, NEW_SHARE
from skidyn.effects import Term, TermSum
from skidyn.evidence import Problem, left_out_coefficients


def held_out_residual(
    problem: Problem, terms: Sequence[Term], sigma: Array, keep: Sequence[Term] = ()
) -> tuple[Array, dict[Term, dict[int, Array]]]:
    """Residual of every sample under the model fitted without its fold.

    Parameters
    ----------
    problem : Problem
        Rows, folds and torque.
    terms : sequence of Term
        Every effect of the model.
    sigma : ndarray of shape (n_joints,)
        Noise of one row.
    keep : sequence of Term, default=()
        Terms whose contributions are returned.

    Returns
    -------
    residual : ndarray of shape (n_samples, n_joints), N m or N
        Torque less the prediction of a model fitted without the sample's fold.
    torque : dict of Term to dict of int to ndarray of shape (n_samples,), N m or N
        Contributions of these terms, fitted to all data, by the joints that they reach.
    """
    design = problem.design([problem.term_rows(t) for t in terms])
    whole, left = left_out_coefficients(
        problem,
        design,
        sigma,
        problem.target,
        soft=problem.soft(terms),
        kept=lambda grams: told_alone(
            grams, [t.width for t in terms], [t.trajectories is not None for t in terms]
        ),
    )
    fold = problem.sample_folds(int(np.argmax(problem.rows.counts)))
    prediction = np.zeros_like(problem.torque)
    if problem.rigid_body and problem.robot is not None:
        s = problem.signals
        for f, coefficients in enumerate(left):
            here = fold == f
            prediction[here] = problem.robot.inverse_dynamics(
                s.q[here], s.dq[here], s.ddq[here], parameters=problem.correction(coefficients)
            )
    torque = {}
    wanted = set(keep)
    for term, place in TermSum(terms).slices(len(problem.rigid_index)):
        columns = term.torque_columns(problem.signals)
        for j, block in columns.items():
            prediction[:, j] += (block * left[fold, place]).sum(1)
        if term in wanted:
            torque[term] = {j: block @ whole[place] for j, block in columns.items()}
    return problem.torque - prediction, torque


def folds_alone(problem: Problem, term: Term) -> NDArray[np.bool_]:
    """Folds that alone determine a term, such as that of the recording that touches a stop.

    Parameters
    ----------
    problem : Problem
        Rows and folds.
    term : Term
        An effect of the model.

    Returns
    -------
    ndarray of shape (n_folds,) of bool
    """
    if term.trajectories is not None and len(term.trajectories) == 1:
        return np.ones(problem.n_folds, dtype=bool)
    if term.effect.nameless:
        return np.zeros(problem.n_folds, dtype=bool)
    return shares_of_folds(problem, problem.term_rows(term)) > CONFINED


def told_alone(
    grams: Array, widths: Sequence[int], in_some: Sequence[bool] = ()
) -> NDArray[np.bool_]:
    """Coefficients that the held-out fold determines nearly alone, (n_folds, n_coefficients).

    A coefficient that only one fold determines is not held out with it, because the other folds
    would give it an arbitrary value. Of an effect that acts in some recordings, this holds as soon
    as any combination of its coefficients is determined by one of them: the inertia of a payload of
    two recordings, for example. If friction has another level in all recordings but one, this one
    alone determines the friction to which the levels are added.

    Parameters
    ----------
    grams : ndarray of shape (n_folds, n_coefficients, n_coefficients)
        Products of the columns of every fold.
    widths : sequence of int
        Numbers of columns of the effects, which come after those of the bodies.
    in_some : sequence of bool, default=()
        Whether each effect acts in some recordings only and is held out with whole recordings;
        none by default.
    """
    some_of = in_some or [False] * len(widths)
    squares = _beside(grams, _columns_of(grams.shape[1], widths, some_of))
    alone = np.zeros(squares.shape, dtype=bool)
    end = squares.shape[1]
    for width, some in zip(reversed(widths), reversed(some_of), strict=True):
        own = slice(end - width, end)
        if some:
            confined = _largest_shares(grams[:, own, own]) > CONFINED
        else:
            energy = squares[:, own].sum(1)
            confined = energy > CONFINED * energy.sum()
        alone[:, own] = confined[:, None]
        end -= width
    return alone


def bases_alone(grams: Array, terms: Sequence[Term], further: int = 0) -> NDArray[np.bool_]:
    """Coefficients that one fold determines since other effects differ between recordings.

    Parameters
    ----------
    grams : ndarray of shape (n_folds, n_coefficients, n_coefficients)
        Products of the columns of every fold: bodies, terms and further columns.
    terms : sequence of Term
        Every effect of the model.
    further : int, default=0
        Number of further columns.

    Returns
    -------
    ndarray of shape (n_folds, n_coefficients) of bool
    """
    end = grams.shape[1] - further
    own, widths = grams[:, :end, :end], [t.width for t in terms]
    in_some = [t.trajectories is not None for t in terms]
    alone = np.zeros(grams.shape[:2], dtype=bool)
    if any(in_some):
        alone[:, :end] = told_alone(own, widths, in_some) & ~told_alone(own, widths)
        alone[:, _columns_of(end, widths, in_some)] = False
    return alone


def _columns_of(n: int, widths: Sequence[int], wanted: Sequence[bool]) -> NDArray[np.intp]:
    """Places of the columns of some effects, which come last among n columns."""
    return n - sum(widths) + np.flatnonzero(np.repeat(wanted, widths))


def _beside(grams: Array, others: NDArray[np.intp]) -> Array:
    """Squares of every column in every fold, of the part that some columns do not explain there.

    Of these columns themselves, the whole squares. Shape (n_folds, n_coefficients).
    """
    squares = np.array(np.diagonal(grams, axis1=1, axis2=2))
    if len(others):
        within = np.linalg.pinv(grams[:, others[:, None], others], rcond=NEW_SHARE, hermitian=True)
        explained = np.einsum("fic,fij,fjc->fc", grams[:, others], within, grams[:, others])
        explained[:, others] = 0.0
        squares = np.where(explained > (1 - NEW_SHARE) * squares, 0.0, squares - explained)
    return squares


def _largest_shares(grams: Array) -> Array:
    """Largest share of each fold in the squares of any combination of some columns, (n_folds,)."""
    whole = grams.sum(0)
    size = np.sqrt(np.maximum(np.diagonal(whole), 1e-300))
    values, vectors = np.linalg.eigh(whole / size[:, None] / size)
    told = values > NEW_SHARE * values[-1]
    if not told.any():
        return np.zeros(len(grams))  # the effect does not act in these rows
    basis = vectors[:, told] / np.sqrt(values[told]) / size[:, None]
    return np.linalg.eigvalsh(basis.T @ grams @ basis)[:, -1]


def shares_of_folds(problem: Problem, rows: Mapping[int, Array]) -> Array:
    """Share of each fold in the squares of some columns, shape (n_folds,).

    Parameters
    ----------
    problem : Problem
        Rows and folds.
    rows : mapping of int to ndarray of shape (n_rows_j, k)
        Averaged columns, per joint they reach.
    """
    energy = np.zeros(problem.n_folds)
    for j, columns in rows.items():
        squares = np.einsum("ik,ik->i", columns, columns)
        energy += np.bincount(problem.fold[j], squares, problem.n_folds)
    return np.asarray(energy / max(float(energy.sum()), 1e-300))
