# SPDX-License-Identifier: BSD-3-Clause
"""Signals and torque of a table that follows the X contract, checked."""

from __future__ import annotations

from typing import Any

import numpy as np

from skidyn._columns import ColumnSpec, column_names, resolve_columns
from skidyn._exceptions import ColumnError, LogError
from skidyn._signals import Array, Signals
from skidyn.robots import Robot


def read_signals(
    X: Any,
    tau: Any,
    robot: Robot,
    *,
    trajectory: ColumnSpec = "auto",
    time: ColumnSpec = "auto",
    rate: float | None = None,
) -> tuple[Signals, Array]:
    """Signals and torque of a table that follows the X contract.

    Parameters
    ----------
    X : DataFrame or array of shape (n_samples, n_features)
        Motion.
    tau : array-like of shape (n_samples, n_joints)
        Torque, N m or N.
    robot : Robot
        Robot.
    trajectory, time : int, str or None, default="auto"
        Key columns of X.
    rate : float, Hz, optional
        Sampling rate where X has no time.

    Returns
    -------
    signals : Signals
    torque : ndarray of shape (n_samples, n_joints)
    """
    names = column_names(X)
    values = np.asarray(X.to_numpy() if hasattr(X, "to_numpy") else X)
    torque = np.asarray(tau.to_numpy() if hasattr(tau, "to_numpy") else tau, dtype=float)
    torque = torque.reshape(len(torque), -1)
    columns = resolve_columns(
        names,
        values.shape[1],
        robot.joint_names,
        trajectory=trajectory,
        time=time,
        require_acceleration=names is None,
    )
    if torque.shape != (len(values), columns.n_joints):
        raise LogError(
            f"the torque has shape {torque.shape}; {len(values)} samples of {columns.n_joints} "
            f"joints ({', '.join(robot.joint_names)}) are expected"
        )

    def pick(index: tuple[int, ...] | int) -> Array:
        chosen = list(index) if isinstance(index, tuple) else index
        return np.asarray(values[:, chosen], dtype=float)

    signals = Signals(
        pick(columns.q),
        pick(columns.dq),
        np.zeros((len(values), columns.n_joints)) if columns.ddq is None else pick(columns.ddq),
        np.zeros(len(values), dtype=np.int64)
        if columns.trajectory is None
        else pick(columns.trajectory).astype(np.int64),
        None if columns.time is None else pick(columns.time),
        None if columns.temperature is None else pick(columns.temperature),
        np.array([kind == "prismatic" for kind in robot.joint_types]),
        robot,
    )
    if signals.time is None:
        if rate is None:
            raise ColumnError(
                "X has no time column; name it by time=..., or give the sampling rate by rate=..."
            )
        signals = signals.with_(time=np.arange(len(values)) / rate)
    _check_finite(signals, torque, robot)
    return signals, torque


def _check_finite(signals: Signals, torque: Array, robot: Robot) -> None:
    for name, block in (("q", signals.q), ("dq", signals.dq), ("tau", torque)):
        bad = ~np.isfinite(block)
        if bad.any():
            row, joint = map(int, np.argwhere(bad)[0])
            raise LogError(
                f"{name} of joint {joint + 1} ({robot.joint_names[joint]}) is not finite in row "
                f"{row} ({int(bad.any(1).sum())} such rows); drop or repair them first"
            )
