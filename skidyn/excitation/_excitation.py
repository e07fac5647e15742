# SPDX-License-Identifier: BSD-3-Clause
"""A designed motion."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from skidyn._signals import Array
from skidyn.excitation._basis import FourierBasis, QuinticBasis
from skidyn.robots import Robot

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Excitation:
    """A motion for identification.

    Parameters
    ----------
    robot : Robot
        Robot for which the motion is designed.
    basis : callable
        Functions of time whose weighted sum is the motion.
    middle : ndarray of shape (n_joints,), rad or m
        Pose at start and end.
    weights : ndarray of shape (n_joints, n_functions)
        Weights of the functions, rad or m.
    condition_number : float
        Condition number of the base regressor with columns scaled to equal length; recordings
        already made are included.
    log_determinant : float
        Logarithm of the determinant of the information matrix of base parameters and effects,
        recordings included, per second of recording. Torques are in units of the noise of a fitted
        model, else of the effort limits of the URDF.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.excitation import design_excitation
    >>> excitation = design_excitation(load_planar_arm(), duration=5.0, iterations=2)
    >>> time, q, dq, ddq = excitation.sample(rate=100.0)
    >>> q.shape
    (501, 2)
    """

    robot: Robot = field(repr=False)
    basis: FourierBasis | QuinticBasis
    middle: Array = field(repr=False)
    weights: Array = field(repr=False)
    condition_number: float = np.nan
    log_determinant: float = np.nan

    @property
    def duration(self) -> float:
        """Length in s."""
        return self.basis.duration

    def sample(self, rate: float) -> tuple[Array, Array, Array, Array]:
        """Sample the motion at equal steps of time.

        Parameters
        ----------
        rate : float, Hz
            Samples per second.

        Returns
        -------
        time : ndarray of shape (n_samples,), s
            From 0 to :attr:`duration`, both included.
        q, dq, ddq : ndarray of shape (n_samples, n_joints)
            Position, velocity and acceleration, SI units.
        """
        time = np.arange(0.0, self.duration - 1e-6 / rate, 1 / rate)
        time = np.append(time, self.duration)  # the motion ends at rest at any rate
        q, dq, ddq = self.basis(time) @ self.weights.T
        return time, q + self.middle, dq, ddq

    def to_frame(self, rate: float) -> pd.DataFrame:
        """Sample the motion as a table.

        Parameters
        ----------
        rate : float, Hz
            Samples per second.

        Returns
        -------
        DataFrame
            Columns ``time, q1.., dq1.., ddq1..``.
        """
        import pandas

        time, *states = self.sample(rate)
        n = self.robot.n_joints
        names = [f"{s}{j + 1}" for s in ("q", "dq", "ddq") for j in range(n)]
        table: pd.DataFrame = pandas.DataFrame(np.hstack(states), columns=names)
        table.insert(0, "time", time)
        return table

    def to_csv(self, path: str | Path, rate: float = 100.0) -> None:
        """Write the motion to a CSV file.

        With the measured torques added as columns ``tau1 ..`` it is a log for
        :func:`~skidyn.logs.read_log`.

        Parameters
        ----------
        path : path
            File to write.
        rate : float, Hz, default=100
            Samples per second.
        """
        from skidyn._writing import write_text

        write_text(path, self.to_frame(rate).to_csv(index=False))
