# SPDX-License-Identifier: BSD-3-Clause
"""Errors and warnings of skidyn; every error is a ValueError that states how to fix the input."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


class SkidynError(ValueError):
    """Root of skidyn's errors.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.exceptions import SkidynError
    >>> try:
    ...     load_planar_arm().inverse_dynamics([[0.0]], [[0.0]], [[0.0]])
    ... except SkidynError as error:
    ...     print(type(error).__name__)
    SkidynError
    """


class ColumnError(SkidynError):
    """Columns of X or of a log do not follow the contract.

    Examples
    --------
    >>> import pandas as pd
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.exceptions import ColumnError
    >>> from skidyn.identification import RBDRegressor
    >>> X = pd.DataFrame({"q1": [0.0], "dq1": [0.0]})
    >>> try:
    ...     RBDRegressor(load_planar_arm()).fit(X, [[0.0, 0.0]])
    ... except ColumnError as error:
    ...     print("q2" in str(error))
    True
    """


class EffectError(SkidynError):
    """An effect is unknown or does not fit the robot or the signals.

    Examples
    --------
    >>> from skidyn.effects import get_effect
    >>> from skidyn.exceptions import EffectError
    >>> try:
    ...     get_effect("gremlins")
    ... except EffectError as error:
    ...     print(str(error)[:21])
    no effect 'gremlins';
    """


class LogError(SkidynError):
    """A log cannot be used as it is.

    Examples
    --------
    >>> from skidyn.exceptions import LogError
    >>> from skidyn.logs import read_log
    >>> try:
    ...     read_log("nowhere.csv")
    ... except LogError as error:
    ...     print(error)
    nowhere.csv: no such file.
    """


class MisreadLogError(LogError):
    """A log certainly does not agree with its names and units.

    Parameters
    ----------
    message : str
        Description of the error, and the options that fix it.
    suspicions : sequence of Suspicion
        The certain suspicions.

    Examples
    --------
    >>> from skidyn.exceptions import MisreadLogError
    >>> from skidyn.measurement import Suspicion, refuse_certain
    >>> try:
    ...     refuse_certain([Suspicion("clock_unit", "time is in ms", "steps of 10 s", "certain")])
    ... except MisreadLogError as error:
    ...     print(error.suspicions[0].check)
    clock_unit
    """

    def __init__(self, message: str, suspicions: Sequence[Any] = ()) -> None:
        super().__init__(message)
        self.suspicions = tuple(suspicions)


class RobotDescriptionError(SkidynError):
    """A URDF cannot be turned into a robot.

    Examples
    --------
    >>> from skidyn.exceptions import RobotDescriptionError
    >>> from skidyn.robots import Robot
    >>> try:
    ...     Robot.from_urdf(b"<robot name='empty'/>")
    ... except RobotDescriptionError as error:
    ...     print(isinstance(error, ValueError))
    True
    """


class LogWarning(UserWarning):
    """A log can be used, but may have an error; the message contains the evidence.

    Examples
    --------
    >>> import warnings
    >>> from skidyn.exceptions import LogWarning
    >>> warnings.simplefilter("error", LogWarning)  # doctest: +SKIP
    """


class RobotDescriptionWarning(UserWarning):
    """A URDF can be used, but contains something physically impossible.

    Examples
    --------
    >>> import warnings
    >>> from skidyn.exceptions import RobotDescriptionWarning
    >>> warnings.simplefilter("error", RobotDescriptionWarning)  # doctest: +SKIP
    """
