# SPDX-License-Identifier: BSD-3-Clause
"""Waterfall of the squared error from the first model to the noise floor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from skidyn._signals import Array
from skidyn.inspection._common import (
    MEASURED,
    NOISE,
    PREDICTED,
    RESIDUAL,
    both_torques,
    joint_index,
    pyplot,
    tidy,
)

if TYPE_CHECKING:
    from skidyn.diagnosis import Diagnosis


class ErrorBudgetDisplay:
    """Waterfall of the squared error of one joint: the part that each step removes, and the rest.

    Shares of squared error add up, root mean square errors do not; the latter are shown above the
    bars. Build it with :meth:`from_diagnosis`, :meth:`from_estimator` or :meth:`from_predictions`.

    Parameters
    ----------
    labels : sequence of str
        Names of the models in the order they are compared; for the second and later ones, the added
        effect.
    rmse : array-like of shape (n_models,), N m or N
        Root mean square errors of the models.
    noise_floor : float, optional
        Error that no model could remove, N m or N.
    joint : str, default="joint"
        Name of the joint.
    unit : str, default="N m"
        Unit of the errors.

    Attributes
    ----------
    ax_ : matplotlib Axes
        Axes.
    figure_ : matplotlib Figure
        Figure.
    bars_ : matplotlib BarContainer
        One bar per step; the last one is the remaining error.
    noise_line_ : matplotlib Line2D or None
        Noise floor.

    See Also
    --------
    ErrorMapDisplay : The error by joint and regime.

    Examples
    --------
    >>> from skidyn.inspection import ErrorBudgetDisplay
    >>> display = ErrorBudgetDisplay(["model", "+ dahl"], [2.0, 1.0], noise_floor=0.5).plot()
    >>> [float(bar.get_height()) for bar in display.bars_]
    [1.0, -0.75, 0.25]
    """

    def __init__(
        self,
        labels: Sequence[str],
        rmse: ArrayLike,
        *,
        noise_floor: float | None = None,
        joint: str = "joint",
        unit: str = "N m",
    ) -> None:
        self.labels = list(labels)
        self.rmse = np.asarray(rmse, dtype=float)
        self.noise_floor = noise_floor
        self.joint = joint
        self.unit = unit

    @classmethod
    def from_diagnosis(
        cls, diagnosis: Diagnosis, *, joint: int = 1, ax: Any = None
    ) -> ErrorBudgetDisplay:
        """Draw the history of a diagnosis, on held-out trajectories.

        Parameters
        ----------
        diagnosis : Diagnosis
            From :func:`skidyn.diagnosis.diagnose`.
        joint : int, default=1
            Joint, counted from 1.
        ax : matplotlib Axes, optional
            Axes; a new figure by default.

        Returns
        -------
        display : ErrorBudgetDisplay
            The drawn display, with its artists.
        """
        j = joint_index(joint, len(diagnosis.joint_names))
        labels = ["model as given", *(f"+ {step['added']}" for step in diagnosis.history[1:])]
        return cls(
            labels,
            [step["rmse"][j] for step in diagnosis.history],
            noise_floor=float(diagnosis.noise_floor[j]),
            joint=f"Joint {joint} ({diagnosis.joint_names[j]})",
            unit=diagnosis.comparison.units[j],
        ).plot(ax)

    @classmethod
    def from_estimator(
        cls,
        estimators: Mapping[str, Any],
        X: Any,
        y: Any,
        *,
        joint: int = 1,
        noise_floor: float | None = None,
        unit: str = "N m",
        ax: Any = None,
    ) -> ErrorBudgetDisplay:
        """Predict with each of several models and draw.

        Parameters
        ----------
        estimators : mapping of str to fitted regressor
            Models in the order in which effects were added.
        X : DataFrame or array of shape (n_samples, n_features)
            Motion that was not used for the fits.
        y : array-like of shape (n_samples, n_joints), N m or N
            Measured torque.
        joint : int, default=1
            Joint, counted from 1.
        noise_floor : float, optional
            Error that no model could remove, N m or N.
        unit : str, default="N m"
            Unit of the torque.
        ax : matplotlib Axes, optional
            Axes; a new figure by default.

        Returns
        -------
        display : ErrorBudgetDisplay
            The drawn display, with its artists.
        """
        predictions = {label: model.predict(X) for label, model in estimators.items()}
        return cls.from_predictions(
            y, predictions, joint=joint, noise_floor=noise_floor, unit=unit, ax=ax
        )

    @classmethod
    def from_predictions(
        cls,
        y_true: ArrayLike,
        predictions: Mapping[str, ArrayLike],
        *,
        joint: int = 1,
        noise_floor: float | None = None,
        unit: str = "N m",
        ax: Any = None,
    ) -> ErrorBudgetDisplay:
        """Draw predictions that were made elsewhere.

        Parameters
        ----------
        y_true : array-like of shape (n_samples, n_joints) or (n_samples,), N m or N
            Measured torque.
        predictions : mapping of str to array-like of the shape of y_true
            Predictions of the models in the order in which effects were added.
        joint : int, default=1
            Joint, counted from 1.
        noise_floor : float, optional
            Error that no model could remove, N m or N.
        unit : str, default="N m"
            Unit of the torque.
        ax : matplotlib Axes, optional
            Axes; a new figure by default.

        Returns
        -------
        display : ErrorBudgetDisplay
            The drawn display, with its artists.
        """
        if not predictions:
            raise ValueError("predictions is empty; give at least one model.")
        errors = []
        for y_pred in predictions.values():
            measured, predicted = both_torques(y_true, y_pred)
            j = joint_index(joint, measured.shape[1])
            errors.append(np.sqrt(np.mean((measured - predicted)[:, j] ** 2)))
        display = cls(
            list(predictions), errors, noise_floor=noise_floor, joint=f"Joint {joint}", unit=unit
        )
        return display.plot(ax)

    def plot(self, ax: Any = None) -> ErrorBudgetDisplay:
        """Draw.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Axes; a new figure by default.

        Returns
        -------
        display : ErrorBudgetDisplay
            The drawn display, with its artists.
        """
        if ax is None:
            width = max(4.5, 1.3 * (len(self.rmse) + 1))
            _, ax = pyplot().subplots(figsize=(width, 4), layout="constrained")
        self.ax_, self.figure_ = ax, ax.figure
        share = self._shares()
        heights = np.r_[share[0], np.diff(share), share[-1]]
        bottoms = np.r_[0.0, share[:-1], 0.0]
        falls = [RESIDUAL if h <= 0 else PREDICTED for h in heights[1:-1]]
        self.bars_ = ax.bar(
            range(len(heights)), heights, bottom=bottoms, width=0.6,
            color=[MEASURED, *falls, NOISE], edgecolor="black", linewidth=0.6,
        )  # fmt: skip
        for bar in self.bars_[1:-1]:
            bar.set_hatch("///")  # distinguishes changes from totals without colour
        for i, (height, bottom) in enumerate(zip(heights, bottoms, strict=True)):
            ax.annotate(
                self._text(i), (i, max(bottom, bottom + height)), (0, 3),
                textcoords="offset points", ha="center", va="bottom", fontsize=8,
            )  # fmt: skip
        self.noise_line_ = None
        if self.noise_floor is not None and self.rmse[0] > 0:
            level = (self.noise_floor / self.rmse[0]) ** 2
            self.noise_line_ = ax.axhline(
                level, color="black", linestyle=":", linewidth=1.2,
                label=f"noise floor {self.noise_floor:.3g} {self.unit}",
            )  # fmt: skip
            ax.legend(frameon=False, loc="upper right", fontsize=8)
        ax.set_xticks(range(len(heights)), [_wrapped(n) for n in (*self.labels, "what is left")])
        ax.set_ylim(0, 1.25 * max(1.0, share.max()))
        ax.yaxis.set_major_formatter(lambda value, _: f"{value:.0%}")
        ax.set_ylabel("share of the first squared error")
        ax.set_title(self.joint, loc="left")
        tidy(ax)
        ax.grid(False, axis="x")
        return self

    def _shares(self) -> Array:
        first = self.rmse[0] ** 2
        return self.rmse**2 / first if first > 0 else np.zeros(len(self.rmse))

    def _text(self, i: int) -> str:
        if i in (0, len(self.rmse)):
            return f"{self.rmse[-1 if i else 0]:.3g} {self.unit}"
        return f"→ {self.rmse[i]:.3g} {self.unit}"


def _wrapped(label: str) -> str:
    """Label on several short lines."""
    return label.replace("_", "\n").replace("+ ", "+\u00a0")
