# SPDX-License-Identifier: BSD-3-Clause
"""Evidence: a log reduced to one small triangular factor per trajectory and joint.

For the columns A and the torque y of a trajectory, the triangular factor R of [A | y] holds the
same least-squares problem as all its rows. Factors of two recordings are merged by factorising the
stacked factors, exactly and in any order; a trajectory is left out by not using its factor.

References
----------
G. H. Golub, C. F. Van Loan (2013), Matrix Computations, 4th ed., section 5.3 and 6.5.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from skidyn._exceptions import SkidynError
from skidyn._signals import Array
from skidyn.effects import Term, TermSum
from skidyn.evidence._problem import Problem
from skidyn.robots import Robot

#: Trajectory and joint (from 0) of a factor.
Key = tuple[int, int]
#: Coefficients of columns weaker than this, relative to the strongest direction, stay at zero.
RANK_TOLERANCE = 1e-10
#: Columns that are factorised at a time; more at a time are slower for so few rows.
BLOCK = 8


@dataclass(frozen=True)
class Evidence:
    """Triangular factors of [columns | torque] of every trajectory and joint.

    Parameters
    ----------
    columns : tuple of str
        Names of the columns.
    factors : mapping of (int, int) to ndarray of shape (n_columns + 1, n_columns + 1)
        Upper triangular factor of each trajectory and joint (from 0).
    counts : mapping of (int, int) to float
        Number of rows of each factor; smaller where older evidence has a lower weight.

    Examples
    --------
    >>> import numpy as np
    >>> rows = np.random.default_rng(0).normal(size=(50, 3))
    >>> first = Evidence.from_rows(("a", "b"), {(0, 0): rows[:20]})
    >>> second = Evidence.from_rows(("a", "b"), {(0, 0): rows[20:]})
    >>> whole = Evidence.from_rows(("a", "b"), {(0, 0): rows})
    >>> bool(np.allclose((first + second).solve(), whole.solve()))
    True
    """

    columns: tuple[str, ...]
    factors: Mapping[Key, Array]
    counts: Mapping[Key, float]

    @classmethod
    def from_rows(cls, columns: Sequence[str], rows: Mapping[Key, Array]) -> Evidence:
        """Factorise rows.

        Parameters
        ----------
        columns : sequence of str
            Names of the columns.
        rows : mapping of (int, int) to ndarray of shape (n_rows, n_columns + 1)
            [columns | torque] of every trajectory and joint.

        Returns
        -------
        Evidence
            Factors of the rows.

        Raises
        ------
        SkidynError
            Rows have the wrong width.
        """
        return cls(tuple(columns), {}, {}).with_rows(rows)

    @classmethod
    def from_problem(cls, problem: Problem, terms: Iterable[Term]) -> Evidence:
        """Factorise the averaged rows of a problem.

        Parameters
        ----------
        problem : Problem
            Rows.
        terms : iterable of Term
            Effects beside the rigid body.

        Returns
        -------
        Evidence
            Factors by trajectory and joint.
        """
        terms = list(terms)
        names = column_names(problem.robot, problem.rigid_index, terms)
        return cls.from_rows(names, rows_of_problem(problem, terms))

    def with_rows(self, rows: Mapping[Key, Array]) -> Evidence:
        """The same evidence with further rows, which takes less time than to add their evidence.

        Parameters
        ----------
        rows : mapping of (int, int) to ndarray of shape (n_rows, n_columns + 1)
            [columns | torque] of every trajectory and joint.

        Returns
        -------
        Evidence
            The same columns.

        Raises
        ------
        SkidynError
            Rows have the wrong width.
        """
        factors, counts = dict(self.factors), dict(self.counts)
        for key, block in rows.items():
            if block.shape[1] != len(self.columns) + 1:
                raise SkidynError(
                    f"rows of trajectory {key[0]}, joint {key[1] + 1} have {block.shape[1]} "
                    f"columns; {len(self.columns)} and the torque are expected"
                )
            factors[key] = _triangle(block, factors.get(key))
            counts[key] = counts.get(key, 0) + len(block)
        return Evidence(self.columns, factors, counts)

    @property
    def trajectories(self) -> list[int]:
        """Trajectories with evidence."""
        return sorted({trajectory for trajectory, _ in self.factors})

    @property
    def joints(self) -> list[int]:
        """Joints with evidence, from 0."""
        return sorted({joint for _, joint in self.factors})

    def __add__(self, other: Evidence) -> Evidence:
        if self.columns != other.columns:
            raise SkidynError("evidence of different columns cannot be merged")
        factors, counts = dict(self.factors), dict(self.counts)
        for key, factor in other.factors.items():
            _add(factors, counts, key, factor, other.counts[key])
        return Evidence(self.columns, factors, counts)

    def scaled(self, weight: float) -> Evidence:
        """The same evidence with a lower weight of every row.

        Parameters
        ----------
        weight : float
            Weight of a row, 0 to 1.

        Returns
        -------
        Evidence
            The same columns and trajectories.
        """
        return Evidence(
            self.columns,
            {key: np.sqrt(weight) * factor for key, factor in self.factors.items()},
            {key: weight * count for key, count in self.counts.items()},
        )

    def only(self, trajectories: Iterable[int]) -> Evidence:
        """Evidence of some trajectories.

        Parameters
        ----------
        trajectories : iterable of int
            Trajectories to keep.

        Returns
        -------
        Evidence
            The same columns, fewer trajectories.
        """
        kept = set(trajectories)
        return Evidence(
            self.columns,
            {key: factor for key, factor in self.factors.items() if key[0] in kept},
            {key: count for key, count in self.counts.items() if key[0] in kept},
        )

    def shifted(self, by: int, groups: int | None = None) -> Evidence:
        """The same evidence under higher trajectory numbers.

        Adding evidence merges what has equal numbers. This keeps the trajectories of two
        recordings apart: ``a + b.shifted(max(a.trajectories) + 1)``.

        Parameters
        ----------
        by : int
            Added to every number.
        groups : int, optional
            Numbers are then taken modulo this, and factors with equal numbers are merged.

        Returns
        -------
        Evidence
            The same columns.
        """
        factors: dict[Key, Array] = {}
        counts: dict[Key, float] = {}
        for (trajectory, joint), factor in self.factors.items():
            number = trajectory + by if groups is None else (trajectory + by) % groups
            _add(factors, counts, (number, joint), factor, self.counts[trajectory, joint])
        return Evidence(self.columns, factors, counts)

    def select(self, columns: Sequence[str]) -> Evidence:
        """Evidence of a model with fewer columns.

        Parameters
        ----------
        columns : sequence of str
            Columns to keep, in their new order.

        Returns
        -------
        Evidence
            The same trajectories, fewer columns.

        Raises
        ------
        SkidynError
            A column that is not there.
        """
        index = [*self._index(columns), -1]
        factors = {key: _triangle(factor[:, index]) for key, factor in self.factors.items()}
        return Evidence(tuple(columns), factors, self.counts)

    def without(self, trajectory: int) -> Evidence:
        """Evidence of all trajectories but one.

        Parameters
        ----------
        trajectory : int
            Trajectory to leave out.

        Returns
        -------
        Evidence
            The same columns, one trajectory less.
        """
        return self.only(t for t in self.trajectories if t != trajectory)

    def stacked(self, noise: Mapping[int, float] | None = None) -> Array:
        """Stack all factors, with joints weighted by their noise.

        Parameters
        ----------
        noise : mapping of int to float, optional
            Noise of a row of every joint (from 0); equal by default.

        Returns
        -------
        ndarray of shape (n_factors * (n_columns + 1), n_columns + 1)
            Matrix with the same normal equations as all weighted rows.
        """
        parts = [
            factor / (1.0 if noise is None else noise[key[1]])
            for key, factor in self.factors.items()
        ]
        return np.vstack([np.zeros((0, len(self.columns) + 1)), *parts])

    def solve(
        self, columns: Sequence[str] | None = None, noise: Mapping[int, float] | None = None
    ) -> Array:
        """Least-squares coefficients.

        Parameters
        ----------
        columns : sequence of str, optional
            Columns of the model; all by default, the others are zero.
        noise : mapping of int to float, optional
            Noise of a row of every joint (from 0), by which joints are weighted; equal by default.

        Returns
        -------
        ndarray of shape (n_columns,)
            One coefficient for every column, zero for omitted ones.

        Raises
        ------
        SkidynError
            A column does not exist, or there is no evidence.
        """
        if not self.factors:
            raise SkidynError("no evidence: every trajectory was left out")
        index = self._index(columns)
        stacked = self.stacked(noise)
        stacked = stacked[stacked.any(axis=1)]  # factors have rows of zeros
        a, y = stacked[:, index], stacked[:, -1]
        size = np.linalg.norm(a, axis=0)
        size[size == 0] = 1.0
        coefficients = np.zeros(len(self.columns))
        coefficients[index] = scipy.linalg.lstsq(a / size, y, cond=RANK_TOLERANCE)[0] / size
        return coefficients

    def squared_error(self, coefficients: Array) -> dict[Key, float]:
        """Sum of squared residuals of every trajectory and joint.

        Parameters
        ----------
        coefficients : ndarray of shape (n_columns,)
            Of all columns.

        Returns
        -------
        dict of (int, int) to float
            (N m)^2 or N^2.
        """
        step = np.append(-np.asarray(coefficients, dtype=float), 1.0)
        return {key: float(np.sum((factor @ step) ** 2)) for key, factor in self.factors.items()}

    def noise(self, coefficients: Array) -> dict[int, float]:
        """Root mean square residual of a row of every joint, N m or N.

        Parameters
        ----------
        coefficients : ndarray of shape (n_columns,)
            Of all columns.

        Returns
        -------
        dict of int to float
            By joint, from 0.
        """
        errors = self.squared_error(coefficients)
        return {
            joint: float(
                np.sqrt(
                    sum(e for key, e in errors.items() if key[1] == joint)
                    / max(1, sum(n for key, n in self.counts.items() if key[1] == joint))
                )
            )
            for joint in self.joints
        }

    def held_out_error(
        self, columns: Sequence[str] | None = None, noise: Mapping[int, float] | None = None
    ) -> dict[Key, float]:
        """Root mean square error of every trajectory under the model fitted without it.

        Parameters
        ----------
        columns : sequence of str, optional
            Columns of the model; all by default.
        noise : mapping of int to float, optional
            Noise of a row of every joint, by which joints are weighted.

        Returns
        -------
        dict of (int, int) to float
            Per trajectory and joint, of averaged rows, N m or N.
        """
        result = {}
        for trajectory in self.trajectories:
            coefficients = self.without(trajectory).solve(columns, noise)
            left_out = self.only([trajectory])
            for key, error in left_out.squared_error(coefficients).items():
                result[key] = float(np.sqrt(error / max(1, self.counts[key])))
        return result

    def _index(self, columns: Sequence[str] | None) -> list[int]:
        if columns is None:
            return list(range(len(self.columns)))
        unknown = [name for name in columns if name not in self.columns]
        if unknown:
            raise SkidynError(f"no column {unknown[0]!r}; there are {', '.join(self.columns)}")
        return [self.columns.index(name) for name in columns]


def rows_of_problem(problem: Problem, terms: Iterable[Term]) -> dict[Key, Array]:
    """[columns | torque] of the averaged rows of a problem, by trajectory and joint.

    Parameters
    ----------
    problem : Problem
        Rows.
    terms : iterable of Term
        Effects beside the rigid body.

    Returns
    -------
    dict of (int, int) to ndarray of shape (n_rows, n_columns + 1)
    """
    design = problem.design([problem.term_rows(t) for t in terms])
    rows = {}
    for j, (block, y) in enumerate(zip(design, problem.target, strict=True)):
        whole, trajectory = np.column_stack([block, y]), problem.rows.trajectory[j]
        for name in problem.rows.recordings:
            here = trajectory == name
            if here.any():
                rows[int(name), j] = whole[here]
    return rows


def column_names(
    robot: Robot | None, rigid_index: Sequence[int] | NDArray[np.int64], terms: Iterable[Term]
) -> tuple[str, ...]:
    """Names of the columns of a model.

    Parameters
    ----------
    robot : Robot or None
        Robot, if its rigid body is part of the model.
    rigid_index : sequence of int
        Indices of its parameters that have a column.
    terms : iterable of Term
        Effects.

    Returns
    -------
    tuple of str
        Such as ``"m_link1"`` and ``"viscous.Fv[1]"``, joints counted from 1.
    """
    rigid: list[str] = []
    if robot is not None:
        names = robot.parameter_names
        rigid = [names[i] for i in rigid_index]
    return (*rigid, *TermSum(terms).names)


def _add(
    factors: dict[Key, Array], counts: dict[Key, float], key: Key, factor: Array, count: float
) -> None:
    """Add a factor; it is merged with the one that has its key already, if there is one."""
    factors[key] = _triangle(factor, factors[key]) if key in factors else factor
    counts[key] = counts.get(key, 0) + count


def _triangle(rows: Array, known: Array | None = None) -> Array:
    """Square upper triangular factor of rows, and of those of a known factor.

    A joint has no torque from the links before it and from friction of other joints. Such columns
    of zeros are left out; the factor of the others is triangular in their places, too. LAPACK's
    routine for rows below a triangle leaves out the zeros of that.
    """
    factor = np.zeros((rows.shape[1], rows.shape[1])) if known is None else known.copy()
    used = np.flatnonzero(rows.any(axis=0) | factor.any(axis=0))
    if len(used):
        place = used[:, None], used
        size = min(BLOCK, len(used))
        factor[place] = scipy.linalg.lapack.dtpqrt(0, size, factor[place], rows[:, used])[0]
    return factor
