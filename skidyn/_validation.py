# SPDX-License-Identifier: BSD-3-Clause
"""Validation of a table of motion: columns of torque, as a log has them, are no features."""

from __future__ import annotations

import re
from numbers import Integral
from typing import Any

from sklearn.utils.validation import validate_data

from skidyn._columns import column_names

#: Columns of torque in a log.
TORQUE = re.compile(r"tau\d+")


def validate_motion(estimator: Any, X: Any, *args: Any, **options: Any) -> Any:
    """Validate X, and y if given, as ``validate_data`` does, without columns of torque."""
    return validate_data(estimator, motion_of(estimator, X), *args, **options)


def motion_of(estimator: Any, X: Any) -> Any:
    """A table without the columns ``tau1 ..`` of a log; X itself if it has none.

    A log may be given as X to a fit, and one without torque to ``predict``. Columns are kept if
    the estimator has key columns by position, which count all columns, and in tables of anything
    else than the motion of joints.

    >>> import pandas as pd
    >>> log = pd.DataFrame(0.0, index=[0], columns=["q1", "dq1", "tau1"])
    >>> list(motion_of(None, log))
    ['q1', 'dq1']
    """
    names = column_names(X)
    if names is None or not any(name == "q1" or name.startswith("q_") for name in names):
        return X
    if any(isinstance(getattr(estimator, key, None), Integral) for key in ("trajectory", "time")):
        return X
    kept = [name for name in X.columns if not TORQUE.fullmatch(str(name))]
    return X if len(kept) == len(names) else X[kept]


def table_of(estimator: Any, X: Any, array: Any) -> Any:
    """The motion as given if the columns of X have names, otherwise the validated array."""
    return array if column_names(X) is None else motion_of(estimator, X)
