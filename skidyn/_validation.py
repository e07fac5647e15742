# SPDX-License-Identifier: BSD-3-Clause
"""Validation of a table of motion: columns of torque, as a log has them, are no features."""

from __future__ import annotations

import re
from collections.abc import Sequence
from numbers import Integral
from typing import Any

import numpy as np
from sklearn.utils.validation import validate_data

from skidyn._columns import column_names
from skidyn._exceptions import ColumnError

#: Columns of torque in a log; with names of joints, ``tau_NAME`` is one beside ``q_NAME``.
TORQUE = re.compile(r"tau\d+")


def validate_motion(estimator: Any, X: Any, *args: Any, **options: Any) -> Any:
    """Validate X, and y if given, as ``validate_data`` does, without columns of torque.

    Raises
    ------
    ColumnError
        X or y holds a value that is no finite number; the column and the row are named.
    """
    table = motion_of(estimator, X)
    try:
        return validate_data(estimator, table, *args, **options)
    except ValueError as error:
        if not any(words in str(error) for words in ("NaN", "infinity", "could not convert")):
            raise
        told = "Input y" not in str(error)
        cell = _not_finite("X" if told else "y", table if told else args[0])
        if cell is None:
            raise
        raise ColumnError(cell) from error


def _not_finite(what: str, table: Any) -> str | None:
    """The first cell that is no finite number, and what to do, or None."""
    names = column_names(table)
    if names is None:
        array = np.asarray(table).reshape(len(table), -1)
        columns = {f"column {k}": values for k, values in enumerate(array.T)}
    else:
        columns = {f"column {name!r}": table[name] for name in names}
    for name, values in columns.items():
        for row, value in enumerate(np.asarray(values).tolist()):
            try:
                number = float(value)
            except (TypeError, ValueError):
                number = np.nan
            if not np.isfinite(number):
                said = "NaN" if value != value else "infinite" if number == number else repr(value)
                return (
                    f"{name} of {what} is {said} in row {row}, where a finite number is needed. "
                    "Remove such rows, or the column if it is not needed; "
                    "skidyn.logs.read_log(missing='drop') leaves them out of a log and marks the "
                    "gaps"
                )
    return None


def motion_of(estimator: Any, X: Any) -> Any:
    """A table without the columns ``tau1 ..`` or ``tau_NAME`` of a log; X itself if it has none.

    A log may be given as X to a fit, and one without torque to ``predict``. Columns are kept in
    tables of anything else than the motion of joints.

    Raises
    ------
    ColumnError
        X has torque, and the estimator has key columns by position, which count all columns.

    >>> import pandas as pd
    >>> log = pd.DataFrame(0.0, index=[0], columns=["q1", "dq1", "tau1"])
    >>> list(motion_of(None, log))
    ['q1', 'dq1']
    """
    names = column_names(X)
    if names is None or not any(name == "q1" or name.startswith("q_") for name in names):
        return X
    kept = [name for name in X.columns if not _is_torque(str(name), names)]
    if len(kept) == len(names):
        return X
    for key in ("trajectory", "time"):
        place = getattr(estimator, key, None)
        if isinstance(place, Integral) and -len(names) <= int(place) < len(names):
            raise ColumnError(
                f"X has columns of torque, which are left out, while {key}={place} counts all "
                f"columns. Give the name of the column, such as {key}={names[int(place)]!r}, or "
                "leave the torque out of X"
            )
    return X[kept]


def _is_torque(name: str, names: Sequence[str]) -> bool:
    """Whether a column is the torque of a joint whose position is another one."""
    return bool(TORQUE.fullmatch(name)) or (
        name.startswith("tau_") and f"q_{name.removeprefix('tau_')}" in names
    )


def table_of(estimator: Any, X: Any, array: Any) -> Any:
    """The motion as given if the columns of X have names, otherwise the validated array."""
    return array if column_names(X) is None else motion_of(estimator, X)
