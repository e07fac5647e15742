# SPDX-License-Identifier: BSD-3-Clause
"""A drift is dated, its joint named, and a steady robot raises no alarm."""

from datetime import date, timedelta

import numpy as np
import pytest

from skidyn.evidence import Evidence
from skidyn.exceptions import SkidynError
from skidyn.fleet import monitor_drift

COLUMNS = ("m_link1", "coulomb.Fc[1]", "coulomb.Fc[3]")


def make_history(seed, step=0.0, begin=40, n=80):
    rng, rows = np.random.default_rng(seed), {}
    for day in range(n):
        true = np.array([2.0, 5.0, 3.0 + step * (day >= begin)]) + 0.02 * rng.normal(size=3)
        a = rng.normal(size=(80, 3))
        rows[day, 0] = np.column_stack([a, a @ true + 0.2 * rng.normal(size=80)])
    return Evidence.from_rows(COLUMNS, rows)


def test_drift_is_dated_and_named():
    dates = {k: date(2026, 1, 23) + timedelta(days=k) for k in range(80)}
    report = monitor_drift(make_history(0, step=0.3), dates=dates)
    assert [a["column"] for a in report.alarms()] == ["coulomb.Fc[3]"]
    found = report.alarms()[0]["date"]
    assert date(2026, 3, 4) <= found <= date(2026, 3, 8)
    assert report.messages()[0].startswith(f"coulomb.Fc[3] left its band on {found}: ")


def test_steady_robots_raise_few_alarms():
    alarms = sum(bool(monitor_drift(make_history(seed)).alarms()) for seed in range(1, 41))
    assert alarms <= 2


def test_too_short_histories_are_refused():
    with pytest.raises(SkidynError, match="at least 8 reference"):
        monitor_drift(make_history(0, n=20))
    with pytest.raises(SkidynError, match="at least 8 reference"):
        monitor_drift(make_history(0), reference=3)


@pytest.mark.parametrize(
    ("options", "told"), [({"false_alarm": 2}, "probability"), ({"dates": {1: "a"}}, "dates lacks")]
)
def test_options_that_cannot_be_are_refused(options, told):
    with pytest.raises(SkidynError, match=told):
        monitor_drift(make_history(0), **options)
