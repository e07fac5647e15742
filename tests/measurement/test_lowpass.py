# SPDX-License-Identifier: BSD-3-Clause
"""Low passes: told from delays, and undone."""

import numpy as np
import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.logs import check_log
from skidyn.measurement import without_lowpass

LOG = make_hidden_effect_log(load_ur5(), None, n_trajectories=5, duration=6.0, random_state=2)


def filtered(time, values, constant):
    out = values.copy()
    for i in range(1, len(out)):
        passed = 1 - np.exp((time[i - 1] - time[i]) / constant)
        out[i] = out[i - 1] + passed * (values[i] - out[i - 1])
    return out


def log_with(*columns, change):
    frame = LOG.frame.copy()
    for rows in frame.groupby("trajectory").indices.values():
        time = frame["time"].to_numpy()[rows]
        for name in columns:
            frame.loc[frame.index[rows], name] = change(time, frame[name].to_numpy()[rows])
    return {s.check: s for s in check_log(frame, LOG.robot).checks}


def low_pass(time, values):
    return filtered(time, values, 0.04)


def late(time, values):
    return np.interp(time - 0.04, time, values)


def test_what_a_low_pass_was_given_comes_back():
    time = np.cumsum(np.random.default_rng(0).uniform(5e-3, 15e-3, 200))
    values = np.random.default_rng(1).normal(size=200)
    np.testing.assert_allclose(without_lowpass(time, low_pass(time, values), 0.04), values)


@pytest.mark.parametrize(
    "quantity",
    [*(pytest.param(name, marks=pytest.mark.slow) for name in ("tau", "q")), "dq"],
)
def test_a_filtered_quantity_is_not_late(quantity):
    names = [f"{quantity}{k}" for k in range(1, 7)]
    check = "torque_delay" if quantity == "tau" else "velocity_delay"
    told = log_with(*names, change=low_pass)[check]
    name, _, constant = told.remedy.option.partition("=")
    assert name == f"--lowpass {quantity}" and float(constant) == pytest.approx(0.04, rel=0.05)
    assert log_with(*names, change=late)[check].remedy.option.startswith(f"--late {quantity}=0.04")


def test_one_filtered_torque():
    told = log_with("tau2", change=low_pass)["torque_delay"]
    assert told.joints == (2,) and told.remedy.option.startswith("--lowpass tau2=0.0")
