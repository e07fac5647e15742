# SPDX-License-Identifier: BSD-3-Clause
"""Residual against any signal, with the curve of an effect that would explain it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from skidyn._signals import Array, Signals
from skidyn.inspection._common import (
    EFFECT,
    NOISE,
    PREDICTED,
    RESIDUAL,
    both_torques,
    joint_index,
    pyplot,
    read_table,
    tidy,
)

if TYPE_CHECKING:
    from skidyn.diagnosis import Finding
    from skidyn.robots import Robot

BINS = 40
#: Number of points drawn; more would cover each other.
POINTS = 5000


class ResidualDisplay:
    """Residual of one joint against a signal: points, their quartiles, and a candidate's curve.

    Build it with :meth:`from_estimator`, :meth:`from_predictions` or :meth:`from_finding`.

    Parameters
    ----------
    x : ndarray of shape (n_points,)
        Signal.
    residual : ndarray of shape (n_points,), N m or N
        Measured less predicted torque.
    curve : tuple of ndarray, optional
        ``(x, torque)`` of a candidate effect.
    band : tuple of ndarray, optional
        ``(x, low, middle, high)`` of the residual; its quartiles in bins of x by default.
    joint : str, default="joint"
        Name of the joint.
    variable : str, default="signal"
        Name of x, with its unit.
    candidate : str, default="candidate"
        Name of the candidate.
    unit : str, default="N m"
        Unit of the torque.

    Attributes
    ----------
    ax_ : matplotlib Axes
        Axes.
    figure_ : matplotlib Figure
        Figure.
    scatter_ : matplotlib PathCollection or None
        Points.
    band_ : matplotlib collection
        From the lower to the upper quartile.
    median_line_, curve_line_ : matplotlib Line2D or None
        Middle of the residual; the candidate.

    See Also
    --------
    TorqueDisplay : Torque and residual over time.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.inspection import ResidualDisplay
    >>> speed = np.linspace(-1, 1, 200)
    >>> display = ResidualDisplay.from_predictions(
    ...     np.sign(speed), 0 * speed, against=speed, variable="velocity (rad/s)"
    ... )
    >>> display.ax_.get_xlabel()
    'velocity (rad/s)'
    """

    def __init__(
        self,
        x: Array,
        residual: Array,
        *,
        curve: tuple[Array, Array] | None = None,
        band: tuple[Array, Array, Array, Array] | None = None,
        joint: str = "joint",
        variable: str = "signal",
        candidate: str = "candidate",
        unit: str = "N m",
    ) -> None:
        self.x = x
        self.residual = residual
        self.curve = curve
        self.band = band
        self.joint = joint
        self.variable = variable
        self.candidate = candidate
        self.unit = unit

    @classmethod
    def from_estimator(
        cls,
        estimator: Any,
        X: Any,
        y: Any,
        *,
        against: str = "dq",
        joint: int = 1,
        candidate: Any = None,
        robot: Robot | None = None,
        ax: Any = None,
    ) -> ResidualDisplay:
        """Predict and draw.

        Parameters
        ----------
        estimator : fitted regressor
            Model.
        X : DataFrame or array of shape (n_samples, n_features)
            Motion, following the X contract.
        y : array-like of shape (n_samples, n_joints), N m or N
            Measured torque.
        against : str, default="dq"
            Signal: ``"q"``, ``"dq"``, ``"ddq"`` or ``"temp"`` of the same joint, of another
            joint as ``"q3"``, or ``"time"``.
        joint : int, default=1
            Joint whose residual is drawn, counted from 1.
        candidate : fitted regressor, optional
            A model with a further effect; the difference of its prediction from that of
            ``estimator`` is drawn as the candidate's curve.
        robot : Robot, optional
            Needed for regressors that have none of their own.
        ax : matplotlib Axes, optional
            Axes; a new figure by default.

        Returns
        -------
        display : ResidualDisplay
            The drawn display, with its artists.
        """
        signals, measured, robot = read_table(estimator, X, y, robot)
        j = joint_index(joint, measured.shape[1])
        x, variable = _signal(signals, against, j)
        predicted = np.asarray(estimator.predict(X), dtype=float).reshape(measured.shape)[:, j]
        curve = None
        if candidate is not None:
            richer = np.asarray(candidate.predict(X), dtype=float).reshape(measured.shape)[:, j]
            center, _, middle, _ = _quartiles(x, richer - predicted)
            curve = (center, middle)
        return cls(
            x,
            measured[:, j] - predicted,
            curve=curve,
            joint=f"Joint {joint} ({robot.joint_names[j]})",
            variable=variable,
            unit="N" if signals.prismatic[j] else "N m",
        ).plot(ax)

    @classmethod
    def from_predictions(
        cls,
        y_true: ArrayLike,
        y_pred: ArrayLike,
        *,
        against: ArrayLike,
        joint: int = 1,
        variable: str = "signal",
        curve: tuple[Array, Array] | None = None,
        unit: str = "N m",
        ax: Any = None,
    ) -> ResidualDisplay:
        """Draw predictions that were made elsewhere.

        Parameters
        ----------
        y_true, y_pred : array-like of shape (n_samples, n_joints) or (n_samples,), N m or N
            Measured and predicted torque.
        against : array-like of shape (n_samples,)
            Signal.
        joint : int, default=1
            Joint, counted from 1.
        variable : str, default="signal"
            Name of the signal, with its unit.
        curve : tuple of ndarray, optional
            ``(x, torque)`` of a candidate effect.
        unit : str, default="N m"
            Unit of the torque.
        ax : matplotlib Axes, optional
            Axes; a new figure by default.

        Returns
        -------
        display : ResidualDisplay
            The drawn display, with its artists.
        """
        measured, predicted = both_torques(y_true, y_pred)
        x = np.asarray(against, dtype=float)
        if x.shape != (len(measured),):
            raise ValueError(f"against has shape {x.shape}; {(len(measured),)} is expected.")
        j = joint_index(joint, measured.shape[1])
        display = cls(
            x, (measured - predicted)[:, j], curve=curve, joint=f"Joint {joint}",
            variable=variable, unit=unit,
        )  # fmt: skip
        return display.plot(ax)

    @classmethod
    def from_finding(
        cls, finding: Finding, *, joint: int | None = None, unit: str = "N m", ax: Any = None
    ) -> ResidualDisplay:
        """Draw a finding of a diagnosis: the residual, and the effect that explains it.

        Parameters
        ----------
        finding : Finding
            From ``diagnosis.findings``.
        joint : int, optional
            Joint, counted from 1; the finding's first curve by default.
        unit : str, default="N m"
            Unit of the torque.
        ax : matplotlib Axes, optional
            Axes; a new figure by default.

        Returns
        -------
        display : ResidualDisplay
            The drawn display, with its artists.
        """
        curves = [c for c in finding.curves if joint is None or c["joint"] == joint]
        if not curves:
            known = ", ".join(str(c["joint"]) for c in finding.curves) or "none"
            raise ValueError(f"{finding.kind} has no curve for joint {joint}; it has: {known}.")
        data = curves[0]
        names = ("x", "effect", "measured", "low", "high")
        x, effect, middle, low, high = (np.asarray(data[name], dtype=float) for name in names)
        display = cls(
            x, middle, curve=(x, effect), band=(x, low, middle, high),
            joint=f"Joint {data['joint']}", variable=f"{data['variable']} ({data['unit']})",
            candidate=finding.title, unit=unit,
        )  # fmt: skip
        return display.plot(ax)

    def plot(self, ax: Any = None) -> ResidualDisplay:
        """Draw.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Axes; a new figure by default.

        Returns
        -------
        display : ResidualDisplay
            The drawn display, with its artists.
        """
        if ax is None:
            _, ax = pyplot().subplots(figsize=(6, 4), layout="constrained")
        self.ax_, self.figure_ = ax, ax.figure
        self.scatter_ = self.curve_line_ = None
        band = self.band
        if band is None:
            band = _quartiles(self.x, self.residual)
            every = max(1, len(self.x) // POINTS)
            self.scatter_ = ax.scatter(
                self.x[::every], self.residual[::every], s=4, color=NOISE, alpha=0.35,
                linewidths=0, label="samples", rasterized=True,
            )  # fmt: skip
        center, low, middle, high = band
        self.band_ = ax.fill_between(center, low, high, color=RESIDUAL, alpha=0.25, linewidth=0)
        (self.median_line_,) = ax.plot(
            center, middle, ".", color=RESIDUAL, markersize=6, label="residual: median, quartiles"
        )
        if self.curve is not None:
            (self.curve_line_,) = ax.plot(
                *self.curve, color=PREDICTED, linewidth=2, label=self.candidate
            )
        ax.axhline(0, color=EFFECT, linewidth=0.6)
        ax.set_xlabel(self.variable)
        ax.set_ylabel(f"residual ({self.unit})")
        ax.set_title(self.joint, loc="left")
        # below the picture a legend never covers the data
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, frameon=False)
        tidy(ax)
        return self


def _quartiles(x: Array, values: Array) -> tuple[Array, Array, Array, Array]:
    """Middle of bins of equal count with the quartiles of the values in them."""
    order = np.argsort(x, kind="stable")
    groups = [g for g in np.array_split(order, min(BINS, max(1, len(x) // 5))) if len(g)]
    center = np.array([x[g].mean() for g in groups])
    low, middle, high = np.array([np.quantile(values[g], [0.25, 0.5, 0.75]) for g in groups]).T
    return center, low, middle, high


def _signal(signals: Signals, name: str, joint: int) -> tuple[Array, str]:
    """A signal by its name, and the label of its axis."""
    if name == "time":
        return signals.clock, "time (s)"
    kind = name.rstrip("0123456789")
    which = joint_index(int(name[len(kind) :]), signals.n_joints) if kind != name else joint
    length = "m" if signals.prismatic[which] else "rad"
    tables = {
        "q": (signals.q, length),
        "dq": (signals.dq, f"{length}/s"),
        "ddq": (signals.ddq, f"{length}/s²"),
        "temp": (signals.temperature, "°C"),
    }
    values, unit = tables.get(kind, (None, ""))
    if values is None:
        known = ", ".join(k for k, (v, _) in tables.items() if v is not None)
        raise ValueError(f"against={name!r}: X has no such signal; it has {known} and time.")
    return values[:, which], f"{kind}{which + 1} ({unit})"
