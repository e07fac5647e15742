# SPDX-License-Identifier: BSD-3-Clause
"""PySINDy's sequentially thresholded least squares on skidyn's columns.

Columns and torque have unit size, so that the default threshold of 0.1 removes columns that explain
less than one percent of the squared torque.
"""

import numpy as np
import pysindy
from _answers import by_columns

PACKAGE = "pysindy"


def choose(rows) -> dict[int, float]:
    model = pysindy.STLSQ(threshold=0.1, alpha=0.05, normalize_columns=False)
    found = np.ravel(model.fit(rows.columns, rows.torque[:, None]).coef_)
    return {int(i): float(found[i]) for i in np.flatnonzero(found)}


def answer(log, robot) -> dict:
    return by_columns(log, choose)
