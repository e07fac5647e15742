# SPDX-License-Identifier: BSD-3-Clause
"""Measured against predicted torque, by joint, trajectory and regime."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, Signals
from skidyn.evidence import REST

#: The first five exclude each other; the others may overlap with them.
REGIMES = ("rest", "reversal", "slow", "medium", "fast", "loaded", "warm")
#: Slow and fast as shares of the speed that a joint exceeds in 5 % of its motion.
SLOW, FAST = 0.25, 0.7


@dataclass(frozen=True)
class Comparison:
    """Measured and predicted torque; each sample is predicted without its trajectory.

    Parameters
    ----------
    signals : Signals
        Smoothed motion.
    measured, predicted : ndarray of shape (n_samples, n_joints)
        Torque, N m or N.
    sliding : ndarray of shape (n_samples, n_joints) of bool
        Samples away from rest and reversals.
    joint_names : tuple of str
        Names of the joints.
    judged : ndarray of shape (n_samples, n_joints) of bool, optional
        Samples on which effects are judged: the sliding ones by default, and those at reversals
        where hysteresis was found.
    dry_friction : ndarray of shape (n_samples, n_joints), optional
        Dry friction in the prediction, N m or N; None if the model does not provide it.

    Examples
    --------
    >>> comparison = diagnosis.comparison  # doctest: +SKIP
    >>> comparison.rmse()  # doctest: +SKIP
    array([0.43, 2.37])
    """

    signals: Signals
    measured: Array
    predicted: Array
    sliding: NDArray[np.bool_]
    joint_names: tuple[str, ...]
    judged: NDArray[np.bool_] | None = None
    dry_friction: Array | None = None

    @property
    def judged_samples(self) -> NDArray[np.bool_]:
        """Samples on which effects are judged, (n_samples, n_joints)."""
        return self.sliding if self.judged is None else self.judged

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each joint's torque: N m, or N of a slider."""
        return tuple("N" if slides else "N m" for slides in self.signals.prismatic)

    @property
    def residual(self) -> Array:
        """Measured less predicted torque, N m or N."""
        return self.measured - self.predicted

    def rmse(self, judged: bool = False) -> Array:
        """Root mean square error of every joint.

        Parameters
        ----------
        judged : bool, default=False
            Only the samples on which effects are judged.

        Returns
        -------
        ndarray of shape (n_joints,), N m or N
            Errors of the joints.
        """
        use = self.judged_samples if judged else np.ones_like(self.sliding)
        square = np.where(use, self.residual**2, 0.0).sum(0)
        error: Array = np.sqrt(square / np.maximum(use.sum(0), 1))
        return error

    def table(self) -> list[dict[str, Any]]:
        """Errors of every joint and trajectory.

        Returns
        -------
        list of dict
            With ``joint`` (from 1), ``name``, ``trajectory``, ``rmse``, ``mae`` (N m or N) and
            ``relative`` (rmse over the rms of the measured torque).
        """
        rows, residual = [], self.residual
        for name in np.unique(self.signals.trajectory):
            here = self.signals.trajectory == name
            for j, joint in enumerate(self.joint_names):
                r, tau = residual[here, j], self.measured[here, j]
                rmse = float(np.sqrt(np.mean(r**2)))
                scale = float(np.sqrt(np.mean(tau**2)))
                rows.append(
                    {
                        "joint": j + 1,
                        "name": joint,
                        "trajectory": int(name),
                        "rmse": rmse,
                        "mae": float(np.mean(np.abs(r))),
                        "relative": rmse / scale if scale > 0 else np.inf,
                    }
                )
        return rows

    @cached_property
    def _regimes(self) -> dict[str, NDArray[np.bool_]]:
        s = self.signals
        speed = np.abs(s.dq)
        rest = speed <= REST * s.unit
        high = np.array(
            [
                np.quantile(v[~r], 0.95) if (~r).any() else 1.0
                for v, r in zip(speed.T, rest.T, strict=True)
            ]
        )
        reversal = ~rest & ~self.sliding
        moving = ~rest & ~reversal
        load = np.abs(self.measured if s.load is None else s.load)
        if s.temperature is not None:
            warmth = s.temperature
        else:
            warmth = np.repeat(s.clock[:, None], s.n_joints, axis=1)
        return {
            "rest": rest,
            "reversal": reversal,
            "slow": moving & (speed < SLOW * high),
            "medium": moving & (speed >= SLOW * high) & (speed <= FAST * high),
            "fast": moving & (speed > FAST * high),
            "loaded": moving & (load > np.quantile(load, 0.8, axis=0)),
            "warm": moving & (warmth > np.quantile(warmth, 0.8, axis=0)),
        }


def regimes(comparison: Comparison) -> dict[str, NDArray[np.bool_]]:
    """Samples of every regime, per joint; not to be changed, since they are computed once.

    Parameters
    ----------
    comparison : Comparison
        Measured against predicted torque.

    Returns
    -------
    dict of str to ndarray of shape (n_samples, n_joints) of bool
    """
    return comparison._regimes


def error_map(comparison: Comparison) -> Array:
    """Root mean square error by joint and regime, NaN where a regime does not occur.

    Parameters
    ----------
    comparison : Comparison
        Measured against predicted torque.

    Returns
    -------
    ndarray of shape (n_joints, n_regimes), N m or N
    """
    square = comparison.residual**2
    table = np.full((square.shape[1], len(REGIMES)), np.nan)
    for k, inside in enumerate(regimes(comparison).values()):
        count = inside.sum(0)
        mean = np.where(inside, square, 0.0).sum(0) / np.maximum(count, 1)
        table[:, k] = np.where(count > 0, np.sqrt(mean), np.nan)
    return table
