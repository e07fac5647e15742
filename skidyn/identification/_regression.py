# SPDX-License-Identifier: BSD-3-Clause
"""The linear regression of an identification, as passed to estimators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.effects import Term, TermSum
from skidyn.evidence import (
    Evidence,
    Fit,
    Problem,
    fold_products,
    independent_columns,
    jackknife,
    jackknife_rows,
    left_out_coefficients,
    own_noise,
    weighted_least_squares,
)
from skidyn.robots import Robot, find_base_parameters

#: Number of times that the noise of the joints is estimated and the fit repeated.
PASSES = 4


@dataclass(frozen=True)
class Regression:
    """Rows ``design @ coefficients = target`` of every joint, sorted by fold.

    The rows are those of a log, or the triangular factors of its trajectories, which are equivalent
    for every estimator that does not need single rows.

    Attributes
    ----------
    robot : Robot
        The robot.
    rigid_index : ndarray of shape (n_rigid,)
        Columns of the torque regressor that come first; their coefficients are corrections to the
        parameters of the URDF.
    terms : tuple of Term
        Effects, whose columns follow.
    design : list of ndarray of shape (n_rows_j, n_coefficients)
        Columns of every joint.
    target : list of ndarray of shape (n_rows_j,)
        Torque beyond the rigid body of the URDF, N m or N.
    counts : ndarray of shape (n_joints,)
        Number of rows of the log for every joint.
    fold : list of ndarray of shape (n_rows_j,)
        Fold of every row.
    n_folds : int
        Number of folds.
    fit : Fit or None
        The weighted fit that found the effects' shapes and loads, if there was one and its
        coefficients have no prior.
    instruments : list of ndarray of shape (n_rows_j, n_coefficients) or None
        The same columns along a motion whose errors are independent of those of the log.
    """

    robot: Robot
    rigid_index: NDArray[np.int64]
    terms: tuple[Term, ...]
    design: list[Array]
    target: list[Array]
    counts: Array
    fold: list[NDArray[np.int64]]
    n_folds: int
    fit: Fit | None = None
    instruments: list[Array] | None = None

    @classmethod
    def from_problem(
        cls, problem: Problem, fit: Fit, instruments: list[Array] | None = None
    ) -> Regression:
        """The averaged rows of a log."""
        assert problem.robot is not None
        regression = cls(
            problem.robot,
            problem.rigid_index,
            fit.terms,
            problem.design([problem.term_rows(t) for t in fit.terms]),
            problem.target,
            problem.rows.counts.astype(float),
            problem.fold,
            problem.n_folds,
            fit,
            instruments,
        )
        return regression._drawn()

    @classmethod
    def from_evidence(
        cls, evidence: Evidence, robot: Robot, terms: Sequence[Term], *, whole: bool
    ) -> Regression:
        """Triangular factors in place of rows; a trajectory is a fold.

        The evidence is of all base parameters or none, and of the effects. With ``whole``, base
        parameters that the data does not determine are kept too.
        """
        base = find_base_parameters(robot).index
        names = tuple(robot.parameter_names[i] for i in base)
        n_base = len(base) if evidence.columns[: len(base)] == names else 0
        base = base[:n_base]
        keys = evidence.trajectories
        factors = [
            [evidence.factors[k, j] for k in keys if (k, j) in evidence.factors]
            for j in range(robot.n_joints)
        ]
        p = len(evidence.columns)
        rows = [np.vstack([np.zeros((0, p + 1)), *parts]) for parts in factors]
        shown = np.arange(n_base)
        if n_base and not whole:
            shown = independent_columns(np.vstack(rows)[:, :n_base])
        kept = np.r_[shown, np.arange(n_base, p)]
        fold = [
            np.repeat([i for i, k in enumerate(keys) if (k, j) in evidence.factors], p + 1).astype(
                np.int64
            )
            for j in range(robot.n_joints)
        ]
        counts = [
            sum(evidence.counts[k, j] for k in keys if (k, j) in evidence.counts)
            for j in range(robot.n_joints)
        ]
        regression = cls(
            robot,
            base[shown],
            tuple(terms),
            [block[:, kept] for block in rows],
            [block[:, -1] for block in rows],
            np.array(counts, dtype=float),
            fold,
            len(keys),
        )
        return regression._drawn()

    def _drawn(self) -> Regression:
        """Add rows in every fold that draw the coefficients of flexible functions to zero."""
        places = TermSum(self.terms).slices(self.n_rigid)
        flexible = [(own, term) for term, own in places if term.effect.softness]
        if not flexible:
            return self
        design, target, folds = [*self.design], [*self.target], [*self.fold]
        others = None if self.instruments is None else [*self.instruments]
        for own, term in flexible:
            for j in term.places:
                rows = [np.eye(len(design[j].T))[own]] * self.n_folds
                for f in range(self.n_folds):
                    squares = (design[j][folds[j] == f, own] ** 2).sum(axis=0)
                    rows[f] = np.sqrt(term.effect.softness * squares.max(initial=0.0)) * rows[f]
                more = np.repeat(np.arange(self.n_folds), len(rows[0]))
                order = np.argsort(np.r_[folds[j], more], kind="stable")
                folds[j] = np.r_[folds[j], more][order]
                design[j] = np.vstack([design[j], *rows])[order]
                target[j] = np.r_[target[j], np.zeros(len(more))][order]
                if others is not None:
                    others[j] = np.vstack([others[j], *rows])[order]
        return replace(self, design=design, target=target, fold=folds, fit=None, instruments=others)

    @property
    def n_rigid(self) -> int:
        """Number of rigid-body coefficients, which come first."""
        return len(self.rigid_index)

    def own_noise(self) -> Array:
        """Noise of every joint fitted by itself, N m or N."""
        blocks = zip(self.design, self.target, self.counts, strict=True)
        return np.array([own_noise(a, y, n) for a, y, n in blocks])

    def residual(self, coefficients: Array) -> list[Array]:
        """Residual rows of a model, per joint."""
        return [y - a @ coefficients for a, y in zip(self.design, self.target, strict=True)]

    def noise(self, coefficients: Array) -> Array:
        """Root mean square of the residual rows of every joint, N m or N."""
        squares = [float(np.sum(r**2)) for r in self.residual(coefficients)]
        return np.array(
            [
                np.sqrt(s / n) + 1e-100 if n > 0 else 1.0
                for s, n in zip(squares, self.counts, strict=True)
            ]
        )

    def solve(self, sigma: Array) -> Array:
        """Least squares with joints weighted by their noise."""
        return weighted_least_squares(self.design, self.target, sigma)

    def left_out(self, sigma: Array) -> Array:
        """Solutions without one fold each, shape (n_folds, n_coefficients)."""
        _, left = left_out_coefficients(self, self.design, sigma, self.target, self.instruments)
        return left

    def products(self, sigma: Array) -> tuple[Array, Array]:
        """Gram matrix and right side of every fold."""
        return fold_products(self, self.design, sigma, self.target)

    def copied(self, times: float) -> Regression:
        """The same regression with every row that many times."""
        root = np.sqrt(times)
        return replace(
            self,
            design=[root * a for a in self.design],
            target=[root * y for y in self.target],
            counts=times * self.counts,
        )

    def weighted(self, weights: Sequence[Array]) -> Regression:
        """The same regression with every row weighted."""
        roots = [np.sqrt(w) for w in weights]
        return replace(
            self,
            design=[r[:, None] * a for r, a in zip(roots, self.design, strict=True)],
            target=[r * y for r, y in zip(roots, self.target, strict=True)],
            fit=None,
            instruments=None,
        )


@dataclass(frozen=True)
class Solution:
    """Result of an estimator.

    Attributes
    ----------
    coefficients : ndarray of shape (n_coefficients,)
        In the order of the columns.
    left_out : ndarray of shape (n_folds, n_coefficients)
        The same without one fold each, for standard errors.
    noise : ndarray of shape (n_joints,)
        Noise of one row of every joint, N m or N.
    parameters : ndarray of shape (n_bodies, 10) or None
        Inertial parameters, if the estimator determines more than the base parameters.
    prior : ndarray of shape (k, 10 n_bodies + n_effect_coefficients) or None
        Square root of the prior's curvature in all parameters.
    attributes : dict
        Further attributes of the fitted model.
    open : ndarray of shape (k, n_coefficients) or None
        Undetermined changes of the coefficients, one standard deviation each.
    consistent : bool
        Whether the estimator has already satisfied the constraints of a consistent model.
    urdf_std : float
        Relative error of the bodies of the URDF according to the data; inf if it is not used.
    """

    coefficients: Array
    left_out: Array
    noise: Array
    parameters: Array | None = None
    prior: Array | None = None
    attributes: dict[str, Any] = field(default_factory=dict)
    open: Array | None = None
    consistent: bool = False
    urdf_std: float = np.inf

    @property
    def std(self) -> Array:
        """Standard errors by the jackknife and of open changes; NaN with fewer than two folds."""
        spread = jackknife(self.left_out)
        return spread if self.open is None else np.hypot(spread, np.linalg.norm(self.open, axis=0))

    @property
    def spread(self) -> Array:
        """Rows whose Gram matrix is the covariance of the coefficients, by the jackknife."""
        rows = jackknife_rows(self.left_out)
        return rows if self.open is None else np.vstack([rows, self.open])
