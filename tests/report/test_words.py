# SPDX-License-Identifier: BSD-3-Clause
"""Coefficients and dates in words."""

import numpy as np
import pytest

from skidyn.fleet import DriftReport, FleetComparison
from skidyn.report import render_html, summarize_fleet

COLUMNS = ("viscous.Fv[1]", "coulomb.Fc[2]")


def compared(hostile="robot 8"):
    """Twenty robots, one of which deviates."""
    names = tuple(f"robot {k}" if k != 8 else hostile for k in range(1, 21))
    score = np.tile(np.linspace(-1.5, 1.5, 20)[:, None], (1, 2))
    score[7, 0] = 12.0
    q = np.where(score > 10, 1e-9, 0.9)
    common = {"viscous.Fv[1]": 1.0, "coulomb.Fc[2]": 2.0}
    return FleetComparison(names, COLUMNS, common, 0.1 * score, score, q)


@pytest.mark.parametrize("date, told", [(41, "at trajectory 41"), ("3 May", "on 3 May")])
def test_a_number_is_that_of_a_trajectory(date, told):
    report = DriftReport(
        ("coulomb.Fc[2]",), (date,), np.array([[9.0]]), np.array([[4.0]]), np.array([[6.0]])
    )
    assert f"left its band {told}" in render_html(summarize_fleet(compared(), drift={"a": report}))
