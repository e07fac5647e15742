# SPDX-License-Identifier: BSD-3-Clause
"""Regimes that do not occur."""

import numpy as np

from skidyn.report import summarize


def test_missing_regimes_become_null(fakes):
    diagnosis = fakes.make_diagnosis()
    table = diagnosis.error_map()
    table[0, 0] = np.nan
    diagnosis.error_map = lambda after=False: table
    assert summarize(diagnosis)["where"]["errors"][0][0] is None
