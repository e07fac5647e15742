# SPDX-License-Identifier: BSD-3-Clause
"""Measured and predicted torque over time, with the residual below."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from skidyn._signals import Array, find_segments
from skidyn.inspection._common import (
    MEASURED,
    PREDICTED,
    RESIDUAL,
    both_torques,
    broken,
    joint_index,
    pyplot,
    read_table,
    thinned,
    tidy,
)

if TYPE_CHECKING:
    from skidyn.robots import Robot


class TorqueDisplay:
    """Measured and predicted torque of one joint over time, with the residual below.

    Build it with :meth:`from_estimator` or :meth:`from_predictions`.

    Parameters
    ----------
    time : ndarray of shape (n_samples,), s
        Time.
    measured, predicted : ndarray of shape (n_samples,), N m or N
        Torque of the joint.
    segments : list of slice, optional
        Contiguous runs of rows; no line is drawn from one to the next.
    joint : str, default="joint"
        Name of the joint for the title.
    unit : str, default="N m"
        Unit of the torque.

    Attributes
    ----------
    ax_ : ndarray of two matplotlib Axes
        Torque above, residual below; they zoom together.
    figure_ : matplotlib Figure
        Figure.
    measured_line_, predicted_line_, residual_line_ : matplotlib Line2D
        Lines.

    See Also
    --------
    ResidualDisplay : The residual against any signal.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.inspection import TorqueDisplay
    >>> time = np.linspace(0, 1, 50)
    >>> tau = np.sin(6 * time)
    >>> display = TorqueDisplay.from_predictions(tau, tau - 0.1, time=time)
    >>> round(display.rmse, 3)
    0.1
    """

    def __init__(
        self,
        time: Array,
        measured: Array,
        predicted: Array,
        *,
        segments: list[slice] | None = None,
        joint: str = "joint",
        unit: str = "N m",
    ) -> None:
        self.time = time
        self.measured = measured
        self.predicted = predicted
        self.segments = segments
        self.joint = joint
        self.unit = unit

    @property
    def rmse(self) -> float:
        """Root mean square error of what is drawn, N m or N."""
        return float(np.sqrt(np.mean((self.measured - self.predicted) ** 2)))

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        X: Any,
        y: Any,
        *,
        joint: int = 1,
        trajectory: int | None = None,
        robot: Robot | None = None,
        ax: Any = None,
    ) -> TorqueDisplay:
        """Predict and draw.

        Parameters
        ----------
        estimator : fitted regressor
            Model.
        X : DataFrame or array of shape (n_samples, n_features)
            Motion, following the X contract.
        y : array-like of shape (n_samples, n_joints), N m or N
            Measured torque.
        joint : int, default=1
            Joint, counted from 1.
        trajectory : int, optional
            Only this trajectory; all of them by default.
        robot : Robot, optional
            Needed for regressors that have none of their own.
        ax : array of two matplotlib Axes, optional
            Axes of the torque and of the residual; a new figure by default.

        Returns
        -------
        display : TorqueDisplay
            The drawn display, with its artists.
        """
        signals, measured, robot = read_table(estimator, X, y, robot)
        predicted = np.asarray(estimator.predict(X), dtype=float).reshape(measured.shape)
        rows = np.ones(len(measured), dtype=bool)
        if trajectory is not None:
            rows = signals.trajectory == trajectory
            if not rows.any():
                known = ", ".join(map(str, np.unique(signals.trajectory)))
                raise ValueError(f"X has no trajectory {trajectory}; it has {known}.")
        j = joint_index(joint, measured.shape[1])
        return cls(
            signals.clock[rows],
            measured[rows, j],
            predicted[rows, j],
            segments=find_segments(signals.trajectory[rows], signals.clock[rows]),
            joint=f"Joint {joint} ({robot.joint_names[j]})",
            unit="N" if signals.prismatic[j] else "N m",
        ).plot(ax)

    @classmethod
    def from_predictions(
        cls,
        y_true: ArrayLike,
        y_pred: ArrayLike,
        *,
        time: ArrayLike | None = None,
        joint: int = 1,
        unit: str = "N m",
        ax: Any = None,
    ) -> TorqueDisplay:
        """Draw predictions that were made elsewhere.

        Parameters
        ----------
        y_true, y_pred : array-like of shape (n_samples, n_joints) or (n_samples,), N m or N
            Measured and predicted torque.
        time : array-like of shape (n_samples,), s, optional
            Time; the sample number by default. Where it decreases, a new line begins.
        joint : int, default=1
            Joint, counted from 1.
        unit : str, default="N m"
            Unit of the torque.
        ax : array of two matplotlib Axes, optional
            Axes of the torque and of the residual; a new figure by default.

        Returns
        -------
        display : TorqueDisplay
            The drawn display, with its artists.
        """
        measured, predicted = both_torques(y_true, y_pred)
        j = joint_index(joint, measured.shape[1])
        clock = np.arange(len(measured), dtype=float) if time is None else np.asarray(time, float)
        segments = find_segments(np.zeros(len(clock)), clock)
        display = cls(
            clock, measured[:, j], predicted[:, j], segments=segments, joint=f"Joint {joint}",
            unit=unit,
        )  # fmt: skip
        return display.plot(ax)

    def plot(self, ax: Any = None) -> TorqueDisplay:
        """Draw.

        Parameters
        ----------
        ax : array of two matplotlib Axes, optional
            Axes of the torque and of the residual; a new figure by default.

        Returns
        -------
        display : TorqueDisplay
            The drawn display, with its artists.
        """
        if ax is None:
            _, ax = pyplot().subplots(
                2, 1, sharex=True, figsize=(8, 4.5), height_ratios=(2, 1), layout="constrained"
            )
        self.ax_ = np.asarray(ax)
        self.figure_ = self.ax_[0].figure
        residual = self.measured - self.predicted
        segments = self.segments or [slice(0, len(self.time))]
        pieces = thinned([self.measured, self.predicted, residual], segments)
        time = broken(self.time, pieces)
        above, below = self.ax_
        (self.measured_line_,) = above.plot(
            time, broken(self.measured, pieces), color=MEASURED, linewidth=1.4, label="measured"
        )
        (self.predicted_line_,) = above.plot(
            time, broken(self.predicted, pieces), "--", color=PREDICTED, linewidth=1.2,
            label="predicted",
        )  # fmt: skip
        (self.residual_line_,) = below.plot(
            time, broken(residual, pieces), color=RESIDUAL, linewidth=0.9
        )
        below.axhline(0, color="black", linewidth=0.6)
        above.set_title(f"{self.joint}: RMSE {self.rmse:.3g} {self.unit}", loc="left")
        above.set_ylabel(f"torque ({self.unit})" if self.unit == "N m" else f"force ({self.unit})")
        below.set_ylabel(f"residual ({self.unit})")
        below.set_xlabel("time (s)")
        # next to the title, where it covers no curve
        above.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2, frameon=False)
        for axes in self.ax_:
            tidy(axes)
        return self
