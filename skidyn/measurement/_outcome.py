# SPDX-License-Identifier: BSD-3-Clause
"""Result of the fits of a reading, by column of the torque."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._robust import RobustFit


@dataclass(frozen=True)
class Outcome:
    """Fit of a reading, by column of the recorded torque, for any assignment to joints.

    Attributes
    ----------
    likelihood : ndarray of shape (n_joints,)
        Log-likelihood.
    gain : ndarray of shape (n_joints,)
        Multiple of the robot's own torque; NaN of an identified fit.
    residual : list of ndarray
        Residual of the rows of every column, N m or N.
    scale : ndarray of shape (n_joints,)
        Scale of the residual.
    fits : dict of int to RobustFit
        Fits by column; of the others, all is zero, and scales are one.
    """

    likelihood: Array
    gain: Array
    residual: list[Array]
    scale: Array
    fits: dict[int, RobustFit]

    @classmethod
    def of(cls, n_joints: int, columns: Sequence[int], fits: Sequence[RobustFit]) -> Outcome:
        """Outcome of the fits of some columns."""
        likelihood, scale = np.zeros(n_joints), np.ones(n_joints)
        residual = [np.zeros(0) for _ in range(n_joints)]
        of = dict(zip(columns, fits, strict=True))
        for c, fit in of.items():
            likelihood[c], scale[c], residual[c] = fit.likelihood, fit.scale, fit.residual
        return cls(likelihood, np.full(n_joints, np.nan), residual, scale, of)

    def margin(self, other: Outcome) -> Array:
        """Log-likelihood gain of this reading over another, by joint.

        The correlation of neighbouring rows is that of the more likely one, so that the gain of the
        other over this one is the same with the opposite sign.
        """
        change = self.likelihood - other.likelihood
        for column, gained in enumerate(change > 0):
            change[column] /= (self if gained else other).inflation_of(column)
        return np.asarray(change)

    def gained_over(self, other: Outcome) -> float:
        """The same of all joints."""
        return float(self.margin(other).sum())

    def inflation_of(self, column: int) -> float:
        """Overestimation of a likelihood due to correlated neighbouring rows; few are needed."""
        return self.fits[column].inflation if column in self.fits else 1.0

    @property
    def inflation(self) -> Array:
        """The same of every column, shape (n_joints,)."""
        return np.array([self.inflation_of(column) for column in range(len(self.gain))])
