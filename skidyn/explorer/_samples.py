# SPDX-License-Identifier: BSD-3-Clause
"""Held-out residual of every sample, computed quickly for models that grow term by term."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from skidyn._signals import Array
from skidyn.effects import Term, TermSum
from skidyn.evidence import Problem

#: Number of samples for which the rigid body is computed at once.
MOST = 8192


class Samples:
    """Samples of a problem, each under the fit that left its fold out."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        fold = problem.sample_folds(int(np.argmax(problem.rows.counts)))
        #: Fold of every sample.
        self.fold = fold
        self._of_fold = [np.flatnonzero(fold == f) for f in range(problem.n_folds)]
        self._columns: dict[Term, dict[int, Array]] = {}

    def residual(self, terms: Sequence[Term], coefficients: Sequence[Array], whole: Array) -> Array:
        """Held-out residual as in a diagnosis, of shape (n_samples, n_joints), N m or N.

        The coefficients are those of the fit without each fold, rigid body first. ``whole`` are
        those of the fit to all folds, for effects that can be identified from a single recording
        only and are not held out with it.
        """
        residual = np.array(self.problem.torque)
        self._take_rigid_body(residual, coefficients)
        for term, place in TermSum(terms).slices(len(self.problem.rigid_index)):
            own = np.array([left[place] for left in coefficients])[self.fold]
            if term.trajectories is not None:
                own = whole[None, place]
            for j, block in self._term_columns(term).items():
                residual[:, j] -= np.sum(block * own, axis=1)
        return residual

    def _term_columns(self, term: Term) -> dict[int, Array]:
        if term not in self._columns:
            self._columns[term] = term.torque_columns(self.problem.signals)
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
