# SPDX-License-Identifier: BSD-3-Clause
"""Held-out residual of every sample, quickly again and again for models that grow by a term."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from skidyn._signals import Array
from skidyn.diagnosis._held_out import sample_folds
from skidyn.effects import Term, get_effect
from skidyn.evidence._problem import Problem, term_columns

#: Samples for which the rigid body is worked out at once.
MOST = 8192


class Samples:
    """Samples of a problem, each under the fit that left its fold out.

    Parameters
    ----------
    problem : Problem
        Rows, folds and torque.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        fold = sample_folds(problem)
        self._fold = fold
        self._of_fold = [np.flatnonzero(fold == f) for f in range(problem.n_folds)]
        self._columns: dict[Term, dict[int, Array]] = {}

    def residual(self, terms: Sequence[Term], coefficients: Sequence[Array], whole: Array) -> Array:
        """Held-out residual, as that of a diagnosis.

        Parameters
        ----------
        terms : sequence of Term
            Every effect of the model.
        coefficients : sequence of ndarray of shape (n_coefficients,)
            Of the fit without each fold: rigid body, then terms.
        whole : ndarray of shape (n_coefficients,)
            Of the fit to all folds: what one recording alone can tell is not held out with it.

        Returns
        -------
        ndarray of shape (n_samples, n_joints), N m or N
        """
        residual = np.array(self.problem.torque)
        self._take_rigid_body(residual, coefficients)
        at = len(self.problem.rigid_index)
        for term in terms:
            k = len(get_effect(term.kind).coefficients)
            own = np.array([left[at : at + k] for left in coefficients])[self._fold]
            if "trajectory" in term.shape:
                own = whole[None, at : at + k]
            for j, block in self._term_columns(term).items():
                residual[:, j] -= np.sum(block * own, axis=1)
            at += k
        return residual

    def _term_columns(self, term: Term) -> dict[int, Array]:
        if term not in self._columns:
            self._columns[term] = term_columns(self.problem.signals, term)
        return self._columns[term]

    def _take_rigid_body(self, residual: Array, coefficients: Sequence[Array]) -> None:
        problem, s = self.problem, self.problem.signals
        if not problem.rigid_body or problem.robot is None:
            return
        # the engine keeps its buffers only where all calls have one length
        size = min(max(len(here) for here in self._of_fold), MOST)
        for here, left in zip(self._of_fold, coefficients, strict=True):
            change = problem.correction(left)
            for start in range(0, len(here), size):
                rows = here[start : start + size]
                filled = np.resize(rows, size)
                torque = problem.robot.inverse_dynamics(
                    s.q[filled], s.dq[filled], s.ddq[filled], parameters=change
                )
                residual[rows] -= torque[: len(rows)]
