# SPDX-License-Identifier: BSD-3-Clause
"""Base parameters: the combinations of inertial parameters on which torque depends.

References
----------
M. Gautier (1991), Numerical calculation of the base inertial parameters of robots, J. Robotic
Systems 8(4), 485-506.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.robots._robot import Robot

#: Number of random states from which the structure is found, and the tolerance of its rank.
STATES, TOLERANCE = 400, 1e-9
#: Error of the entries of a rotation whose angles were rounded to three decimals, and of numbers.
ROUNDED, EXACT = 5e-4, 1e-8
#: Factors of a combination smaller than this are due to rounding.
NEGLIGIBLE = 1e-7


@dataclass(frozen=True)
class BaseParameters:
    """Independent columns of the torque regressor and the regrouping of the others.

    Parameters
    ----------
    index : ndarray of shape (n_base,)
        Columns of the torque regressor that are kept.
    regrouping : ndarray of shape (n_base, 10 * n_bodies)
        Base parameters as combinations of all inertial parameters.
    expressions : tuple of str
        The combinations as text, such as ``"Izz_link1 + 0.04*m_link2"``.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm
    >>> find_base_parameters(load_planar_arm()).expressions[0]
    'mcx_link1'
    """

    index: NDArray[np.int64]
    regrouping: Array
    expressions: tuple[str, ...]

    def values(self, inertial_parameters: Array) -> Array:
        """Base parameters of given inertial parameters.

        Parameters
        ----------
        inertial_parameters : ndarray of shape (n_bodies, 10)
            Of every body.

        Returns
        -------
        ndarray of shape (n_base,)
            In the order of ``index``.
        """
        return self.regrouping @ np.ravel(inertial_parameters)


def find_base_parameters(robot: Robot) -> BaseParameters:
    """Find the base parameters of a robot by random motion within its limits.

    Parameters
    ----------
    robot : Robot
        Robot.

    Returns
    -------
    BaseParameters
        Columns, combinations and their names.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm
    >>> len(find_base_parameters(load_planar_arm()).index)
    6
    """
    return _find(robot)


def base_parameter_index(robot: Robot) -> NDArray[np.int64]:
    """Columns of the torque regressor that are linearly independent."""
    return _find(robot).index


@lru_cache(maxsize=64)
def _find(robot: Robot) -> BaseParameters:
    from scipy.linalg import qr, solve_triangular  # not needed to read a robot

    robot = with_whole_turns(robot)
    rng = np.random.default_rng(0)
    n, p = robot.n_joints, 10 * robot.n_bodies
    # More states than unknowns for any size of robot.
    count = max(STATES, 2 * p // n + 20)
    q, dq, ddq = rng.uniform(-np.pi, np.pi, (3, count, n))
    regressor = np.asarray(robot.torque_regressor(q, dq, ddq)).reshape(-1, p)
    size = np.linalg.norm(regressor, axis=0)
    moved = np.flatnonzero(size > TOLERANCE * max(size.max(initial=0.0), 1e-300))
    triangle, pivots = qr(regressor[:, moved] / size[moved], mode="r", pivoting=True)
    diagonal = np.abs(np.diag(triangle))
    rank = int(np.sum(diagonal > TOLERANCE * diagonal[0])) if len(diagonal) else 0
    independent, dependent = moved[pivots[:rank]], moved[pivots[rank:]]
    joined = solve_triangular(triangle[:rank, :rank], triangle[:rank, rank:])
    regrouping = np.zeros((rank, p))
    regrouping[np.arange(rank), independent] = 1.0
    # Columns of unit size, so that the threshold does not depend on units.
    joined[np.abs(joined) < NEGLIGIBLE] = 0.0
    regrouping[:, dependent] = joined * size[dependent] / size[independent][:, None]
    order = np.argsort(independent)
    regrouping = regrouping[order]
    names = robot.parameter_names
    expressions = tuple(
        _expression(row, int(own), names)
        for row, own in zip(regrouping, independent[order], strict=True)
    )
    return BaseParameters(independent[order].astype(np.int64), regrouping, expressions)


@lru_cache(maxsize=64)
def with_whole_turns(robot: Robot) -> Robot:
    """Robot whose frames are quarter turns apart where its description rounds these.

    Descriptions write 3.1416 for half a turn. A first joint that is vertical but for a thousandth
    of a degree then feels the weight of the links by some millionths, and a regression would
    identify masses of tons from these. Regressors of a fit are those of this robot; torque is
    computed with the frames as described. It is the same object if no angle was rounded.
    """
    tree = robot.tree
    rotations, axes = _whole(tree.rotations), _whole(tree.axes)
    apart = max(
        np.abs(rotations - tree.rotations).max(initial=0.0),
        np.abs(axes - tree.axes).max(initial=0.0),
    )
    if apart < EXACT:
        return robot
    return replace(robot, tree=replace(tree, rotations=rotations, axes=axes))


def _whole(values: Array) -> Array:
    """Matrices or vectors, those that are nearly of zeros and ones rounded to them."""
    rounded = np.round(values)
    apart = np.abs(values - rounded).reshape(len(values), -1).max(axis=1, initial=0.0) < ROUNDED
    return np.where(apart.reshape(-1, *[1] * (values.ndim - 1)), rounded + 0.0, values)


def _expression(row: Array, own: int, names: tuple[str, ...] | list[str]) -> str:
    text = names[own]
    for k in np.flatnonzero(row):
        if k != own:
            sign = "+" if row[k] > 0 else "-"
            factor = abs(row[k])
            text += (
                f" {sign} {names[k]}"
                if abs(factor - 1) < NEGLIGIBLE
                else (f" {sign} {factor:.6g}*{names[k]}")
            )
    return text
