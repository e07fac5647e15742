# SPDX-License-Identifier: BSD-3-Clause
"""Lag of a torque whose clock runs at a different rate."""

import ast

import numpy as np
import pytest

from skidyn.logs import check_log, read_log


def drifting(frame, lag, growth, since):
    """A log whose torque is late by a lag that grows."""
    changed = frame.copy()
    for rows in frame.groupby("trajectory").groups.values():
        time = frame.loc[rows, "time"].to_numpy()
        at = time - lag - growth * since(time)
        for name in ("tau1", "tau2"):
            changed.loc[rows, name] = np.interp(at, time, frame.loc[rows, name])
    return changed


def told_delays(frame, arm):
    return [s for s in check_log(frame, arm).checks if s.check == "torque_delay"]


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_growth_of_a_lag_is_estimated_and_removed(short, arm, tmp_path):
    changed = drifting(short, 0.01, -0.02, lambda time: time - time[0])
    (told,) = told_delays(changed, arm)
    value = told.remedy.code.removeprefix("late=")
    lag, growth = ast.literal_eval(value)["tau"]
    assert lag == pytest.approx(0.01, abs=2e-3) and growth == pytest.approx(-0.02, abs=1e-3)
    assert told.remedy.option == f"--late tau={lag:g}{growth:+g}*t"
    path = tmp_path / "log.csv"
    changed.to_csv(path, index=False)
    mended = read_log(path, robot=arm, late={"tau": (lag, growth)}, check=False)
    assert told_delays(mended, arm) == []


def test_a_clock_that_is_set_once_has_no_remedy(short, arm):
    first = short["time"].iloc[0]
    changed = drifting(short, 0.0, 0.003, lambda time: time - first)
    told = told_delays(changed, arm)
    assert not any(s.remedy and "*t" in s.remedy.option for s in told)
