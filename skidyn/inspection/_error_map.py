# SPDX-License-Identifier: BSD-3-Clause
"""Error of a model by joint and regime."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from skidyn._signals import Array, Signals
from skidyn.inspection._common import both_torques, pyplot, read_table

if TYPE_CHECKING:
    from skidyn.diagnosis import Diagnosis
    from skidyn.robots import Robot


class ErrorMapDisplay:
    """Error by joint and regime: rest, reversal, slow, medium, fast, loaded, warm.

    The colour is the ratio of the error in the regime to that of the whole joint, so that strong
    and weak joints can be compared; the numbers are the errors. Build it with
    :meth:`from_diagnosis`, :meth:`from_estimator` or :meth:`from_predictions`.

    Parameters
    ----------
    errors : array-like of shape (n_joints, n_regimes), N m or N
        Root mean square errors, NaN where a regime does not occur.
    overall : array-like of shape (n_joints,), N m or N
        Root mean square error of every joint.
    joints, regimes : sequence of str
        Names of rows and columns.

    Attributes
    ----------
    ax_ : matplotlib Axes
        Axes.
    figure_ : matplotlib Figure
        Figure.
    image_ : matplotlib AxesImage
        Coloured cells.
    text_ : ndarray of shape (n_joints, n_regimes) of matplotlib Text
        Numbers.

    See Also
    --------
    ResidualDisplay : The residual against any signal.

    Examples
    --------
    >>> from skidyn.inspection import ErrorMapDisplay
    >>> display = ErrorMapDisplay([[1.0, 3.0]], [2.0], ["joint 1"], ["slow", "fast"]).plot()
    >>> display.text_[0, 1].get_text()
    '3'
    """

    def __init__(
        self,
        errors: ArrayLike,
        overall: ArrayLike,
        joints: Sequence[str],
        regimes: Sequence[str],
    ) -> None:
        self.errors = np.asarray(errors, dtype=float)
        self.overall = np.asarray(overall, dtype=float)
        self.joints = list(joints)
        self.regimes = list(regimes)

    @classmethod
    def from_diagnosis(
        cls, diagnosis: Diagnosis, *, after: bool = False, ax: Any = None
    ) -> ErrorMapDisplay:
        """Draw the held-out errors of a diagnosis.

        Parameters
        ----------
        diagnosis : Diagnosis
            From :func:`skidyn.diagnosis.diagnose`.
        after : bool, default=False
            Draw the errors with the findings added.
        ax : matplotlib Axes, optional
            Axes; a new figure by default.

        Returns
        -------
        display : ErrorMapDisplay
            The drawn display, with its artists.
        """
        comparison = diagnosis.comparison_after if after else diagnosis.comparison
        return cls(
            diagnosis.error_map(after), comparison.rmse(), diagnosis.joint_names, diagnosis.regimes
        ).plot(ax)

    @classmethod
    def from_estimator(
        cls, estimator: Any, X: Any, y: Any, *, robot: Robot | None = None, ax: Any = None
    ) -> ErrorMapDisplay:
        """Predict and draw.

        Parameters
        ----------
        estimator : fitted regressor
            Model.
        X : DataFrame or array of shape (n_samples, n_features)
            Motion, following the X contract.
        y : array-like of shape (n_samples, n_joints), N m or N
            Measured torque.
        robot : Robot, optional
            Needed for regressors that have none of their own.
        ax : matplotlib Axes, optional
            Axes; a new figure by default.

        Returns
        -------
        display : ErrorMapDisplay
            The drawn display, with its artists.
        """
        signals, measured, robot = read_table(estimator, X, y, robot)
        predicted = np.asarray(estimator.predict(X), dtype=float).reshape(measured.shape)
        return cls.from_predictions(
            measured, predicted, signals=signals, joint_names=robot.joint_names, ax=ax
        )

    @classmethod
    def from_predictions(
        cls,
        y_true: ArrayLike,
        y_pred: ArrayLike,
        *,
        signals: Signals,
        joint_names: Sequence[str] | None = None,
        ax: Any = None,
    ) -> ErrorMapDisplay:
        """Draw predictions that were made elsewhere.

        Parameters
        ----------
        y_true, y_pred : array-like of shape (n_samples, n_joints), N m or N
            Measured and predicted torque.
        signals : Signals
            Motion, from which the regimes are found.
        joint_names : sequence of str, optional
            Names of the joints.
        ax : matplotlib Axes, optional
            Axes; a new figure by default.

        Returns
        -------
        display : ErrorMapDisplay
            The drawn display, with its artists.
        """
        from skidyn.diagnosis import REGIMES, Comparison, error_map
        from skidyn.evidence import sliding_samples

        measured, predicted = both_torques(y_true, y_pred)
        names = tuple(joint_names or (f"joint {j + 1}" for j in range(measured.shape[1])))
        rows = np.ones(measured.shape, dtype=bool)
        sliding = sliding_samples(signals, rows, _reversal_margin(signals))
        comparison = Comparison(signals, measured, predicted, sliding, names)
        return cls(error_map(comparison), comparison.rmse(), names, REGIMES).plot(ax)

    def plot(self, ax: Any = None) -> ErrorMapDisplay:
        """Draw.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Axes; a new figure by default.

        Returns
        -------
        display : ErrorMapDisplay
            The drawn display, with its artists.
        """
        shape = self.errors.shape
        if ax is None:
            size = (2.5 + 0.8 * shape[1], 1.4 + 0.42 * shape[0])
            _, ax = pyplot().subplots(figsize=size, layout="constrained")
        self.ax_, self.figure_ = ax, ax.figure
        relative = self._relative()
        # cividis looks nearly the same with any kind of colour blindness
        self.image_ = ax.imshow(relative, cmap="cividis", vmin=0, vmax=2, aspect="auto")
        self.text_ = np.empty(shape, dtype=object)
        for j, k in np.ndindex(*shape):
            value, dark = self.errors[j, k], relative[j, k] < 1.1
            self.text_[j, k] = ax.text(
                k,
                j,
                f"{value:.2g}" if np.isfinite(value) else "–",
                ha="center",
                va="center",
                fontsize=9,
                color="white" if dark else "black",
            )
        ax.set_xticks(range(shape[1]), self.regimes)
        ax.set_yticks(range(shape[0]), [f"{j + 1}  {name}" for j, name in enumerate(self.joints)])
        ax.set_title("Error by joint and regime (N m; N for sliders)", loc="left", fontsize=10)
        ax.tick_params(length=0)
        ax.spines[:].set_visible(False)
        self.figure_.colorbar(self.image_, ax=ax, label="over the joint's error", extend="max")
        return self

    def _relative(self) -> Array:
        whole = np.where(self.overall > 0, self.overall, np.nan)
        return self.errors / whole[:, None]


def _reversal_margin(signals: Signals) -> int:
    """Samples around a reversal that count as part of it: a twentieth of a second."""
    return max(1, round(0.05 * signals.rate))
