# SPDX-License-Identifier: BSD-3-Clause
"""Common parts of all pictures: colours, reading of tables, thinning, axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from skidyn._exceptions import ColumnError
from skidyn._optional import import_optional
from skidyn._signals import Array, Signals, read_signals

if TYPE_CHECKING:
    from skidyn.robots import Robot

#: Okabe and Ito's colours, which colour-blind people can distinguish; lines also differ in style.
MEASURED, PREDICTED, RESIDUAL, EFFECT, NOISE = "#595959", "#D55E00", "#0072B2", "#000000", "#999999"
#: A line of a picture holds about this many points; more cannot be seen.
DRAWN = 4000


def pyplot() -> Any:
    """Return ``matplotlib.pyplot``, or say how to install it."""
    return import_optional("matplotlib.pyplot", extra="plot")


def robot_of(estimator: Any, robot: Robot | None) -> Robot:
    """The given robot, else that of the estimator."""
    from skidyn.robots import Robot

    for found in (robot, getattr(estimator, "robot_", None), getattr(estimator, "robot", None)):
        if found is not None:
            return found if isinstance(found, Robot) else Robot.from_urdf(found)
    raise ColumnError("this regressor has no robot; pass robot=Robot.from_urdf(...)")


def read_table(estimator: Any, X: Any, y: Any, robot: Robot | None) -> tuple[Signals, Array, Robot]:
    """Signals and measured torque of a table that follows the X contract."""
    robot = robot_of(estimator, robot)
    # Time is needed only for the axis of a picture; without it the sample number is used.
    signals, torque = read_signals(
        X,
        y,
        robot,
        trajectory=getattr(estimator, "trajectory", "auto"),
        time=getattr(estimator, "time", "auto"),
        rate=1.0,
    )
    return signals, torque, robot


def both_torques(y_true: ArrayLike, y_pred: ArrayLike) -> tuple[Array, Array]:
    """Measured and predicted torque as two tables of one shape; a ValueError if they differ."""
    measured, predicted = (np.asarray(y, dtype=float) for y in (y_true, y_pred))
    if measured.shape != predicted.shape:
        raise ValueError(
            f"y_true has shape {measured.shape} and y_pred {predicted.shape}; both must be "
            "(n_samples, n_joints)."
        )
    return measured.reshape(len(measured), -1), predicted.reshape(len(measured), -1)


def joint_index(joint: int, n_joints: int) -> int:
    """Column of a joint counted from 1.

    >>> joint_index(2, 3)
    1
    """
    if not 1 <= joint <= n_joints:
        raise ValueError(f"joint={joint}: joints are counted from 1 to {n_joints}.")
    return joint - 1


def thinned(signals: list[Array], segments: list[slice]) -> list[NDArray[np.intp]]:
    """Rows of each segment to draw, without losing a peak."""
    from skidyn.report import rows_with_peaks

    return rows_with_peaks(signals, segments, DRAWN // (2 * len(signals)))


def broken(values: Array, pieces: list[NDArray[np.intp]]) -> Array:
    """Values of the pieces with NaN between them, where no line must be drawn."""
    gap = [np.nan]
    return np.concatenate([part for rows in pieces for part in (values[rows], gap)][:-1])


def tidy(axes: Any) -> None:
    """Light grid, no box."""
    axes.grid(True, color="#cccccc", linewidth=0.5, alpha=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_axisbelow(True)
