# SPDX-License-Identifier: BSD-3-Clause
"""Reading of X and y for an RBDRegressor: columns, order of the rows, derivatives."""

from __future__ import annotations

import os
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.utils.validation import check_is_fitted

from skidyn._checks import warn_about_log
from skidyn._columns import Columns, ColumnSpec, resolve_columns, trajectory_numbers
from skidyn._exceptions import ColumnError
from skidyn._order import has_one_motion, order_in_time
from skidyn._signals import (
    Array,
    Signals,
    rates_of,
    refuse_other_gravity,
    refuse_other_order,
    signals_from,
)
from skidyn._text import counted
from skidyn._validation import validate_motion
from skidyn.effects import Term
from skidyn.evidence import broken_notes, smooth_motion
from skidyn.identification._recordings import Recordings, named_recordings, recognise
from skidyn.robots import Robot


class Reading:
    """Motion and torque of a regressor's X and y, checked and in the order of time."""

    robot: Robot | str | os.PathLike[str]
    robot_: Robot
    smooth: bool | None
    trajectory: ColumnSpec
    time: ColumnSpec
    columns_: Columns
    effect_terms_: list[Term]
    recordings_: Recordings

    def _begin(self, X: Any, y: Any, first: bool) -> tuple[Signals, Array, NDArray[np.intp]]:
        """Motion and torque of validated data in the order of time, and that order."""
        table, targets = X, y
        X, y = validate_motion(
            self, X, y, reset=first, multi_output=True, y_numeric=True, dtype=np.float64
        )
        if first:
            self._one_output = y.ndim == 1
            given = self.robot
            self.robot_ = given if isinstance(given, Robot) else Robot.from_urdf(given)
            self.columns_ = self._resolve(X.shape[1])
            self._refuse_to_smooth()
        refuse_other_gravity(table, self.robot_)
        refuse_other_order(targets, self.robot_)
        torque = y.reshape(len(y), -1)
        self._check_targets(torque)
        order = self._order(X)
        signals, torque = self._read(X[order]), torque[order]
        if self.columns_.trajectory is not None:
            self._doubt_trajectories(signals.trajectory, self.columns_.trajectory)
        if signals.time is not None and np.any(np.diff(order) != 1):
            _warn_of_leakage()
            if not has_one_motion(signals.trajectory, signals.time):
                # Recordings that cannot be separated: no row has a neighbour.
                signals = self._without_clock(signals)
        self._refuse_a_clock_that_stands(signals)
        if not first and named_recordings(self.effect_terms_):
            signals = recognise(signals, self.recordings_)
        notes = broken_notes(signals, torque, self.robot_.joint_names)
        self._broken = bool(notes)
        for what, where in notes:
            warn_about_log(f"{what}: {where}.")  # as the checks say it
        return signals, torque, order

    @staticmethod
    def _refuse_a_clock_that_stands(signals: Signals) -> None:
        """Refuse times of which most are those of the row before."""
        if signals.time is None or not signals.within.any():
            return
        steps = np.diff(signals.time)[signals.within]
        if np.median(steps) == 0:
            raise ColumnError(
                "most times of X are equal to those of the row before, so that the log has no "
                "rate: give times in s as float64 (float32 cannot hold seconds since 1970), from "
                "the start of the log, or time=None"
            )

    def _doubt_trajectories(self, numbers: NDArray[Any], column: int) -> None:
        """Warn if the column of trajectories looks like another signal."""
        fractions = np.any(numbers != np.round(numbers))
        alone = len(numbers) > 2 and len(np.unique(numbers)) == len(numbers)
        if fractions or alone:
            names = getattr(self, "feature_names_in_", None)
            which = column if names is None else repr(str(names[column]))
            holds = "numbers that are not whole" if fractions else "another number in every row"
            warn_about_log(
                f"the column {which} of X, which is declared as that of the trajectories, holds "
                f"{holds}. Rows are consecutive only within a trajectory, so that hardly any row "
                "has a neighbour and no rows are averaged. Give the column that numbers the "
                "recordings (0, 1, ..), or trajectory=None; give a clock as time="
            )

    def _without_clock(self, signals: Signals) -> Signals:
        if self._smooths():
            raise ColumnError(
                "rows of X with equal time belong to several recordings, so that accelerations "
                "cannot be derived from them; number the recordings in a column 'trajectory', or "
                "give ddq1.. and smooth=False"
            )
        return signals.with_(time=None)

    def _refuse_to_smooth(self) -> None:
        if self.smooth and self.columns_.time is None:
            raise ColumnError(
                "smooth=True derives accelerations along the time, which X lacks: add the column "
                "time, s, or give smooth=None and the accelerations ddq1 .. of X"
            )

    def _smooths(self) -> bool:
        if self.smooth is not None:
            return self.smooth
        return self.columns_.ddq is None

    def _read(self, X: Array) -> Signals:
        if self.columns_.ddq is None and self.columns_.time is None:
            raise ColumnError(
                "X has neither accelerations nor time to derive them from; add ddq1.. or time"
            )
        signals = signals_from(X, self.columns_, self.robot_, to_derive=True)
        if self.columns_.ddq is not None:
            return signals
        alone = [rows.start for rows in signals.segments if rows.stop - rows.start < 2]
        if alone:
            told = (
                "has no neighbour in time, so that no acceleration follows from its velocity. Give "
                "ddq1 .. in X, or at least two successive samples of a trajectory"
            )
            if len(alone) == signals.n_samples:
                raise ColumnError(f"every row of X, such as row {alone[0]}, {told}")
            warn_about_log(
                f"{counted(len(alone), 'row')} of X, such as row {alone[0]}, {told}; its "
                "acceleration is taken as zero."
            )
        return signals.with_(ddq=_differences(signals))

    def _motion(self, X: Any) -> tuple[Signals, NDArray[np.intp]]:
        """Motion in the order of time, and the positions of the rows of X in it."""
        check_is_fitted(self)
        refuse_other_gravity(X, self.robot_)
        X = validate_motion(self, X, reset=False, dtype=np.float64)
        order = self._order(X)
        signals = self._read(X[order])
        if named_recordings(self.effect_terms_):
            signals = recognise(signals, self.recordings_)
        if self._smooths():
            signals = smooth_motion(signals)
        return signals.with_(robot=self.robot_), np.argsort(order)

    def _order(self, X: Array) -> NDArray[np.intp]:
        """Rows of X in the order of time."""
        columns = self.columns_
        time = None if columns.time is None else X[:, columns.time]
        order = order_in_time(trajectory_numbers(X, columns), time)
        return np.arange(len(X)) if order is None else order

    def _resolve(self, n_features: int) -> Columns:
        names = getattr(self, "feature_names_in_", None)
        return resolve_columns(
            None if names is None else list(names),
            n_features,
            self.robot_.joint_names,
            trajectory=self.trajectory,
            time=self.time,
            require_acceleration=self.smooth is False,
        )

    def _check_targets(self, torque: Array) -> None:
        n = self.robot_.n_joints
        if torque.shape[1] != n:
            raise ColumnError(
                f"y has {torque.shape[1]} column(s); the robot has {counted(n, 'joint')} "
                f"({', '.join(self.robot_.joint_names)})"
            )


def _differences(signals: Signals) -> Array:
    """Accelerations by differences, for pieces that are too short for the smoother."""
    time = signals.clock
    advancing = [rows for rows in signals.segments if np.all(np.diff(time[rows]) > 0)]
    return rates_of(signals.dq, time, advancing)


def _warn_of_leakage() -> None:
    from skidyn.model_selection import LeakageWarning

    warnings.warn(
        "the rows of X are not in the order of time, as after train_test_split or "
        "KFold(shuffle=True). They are sorted by trajectory and time and the fit is valid, but a "
        "score on the rows between them is optimistic. Hold out whole trajectories: "
        "TrajectoryKFold, GroupKFold, or GroupShuffleSplit",
        LeakageWarning,
        stacklevel=4,
    )
