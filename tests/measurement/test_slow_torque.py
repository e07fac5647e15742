# SPDX-License-Identifier: BSD-3-Clause
"""Torque from a slower bus."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.logs import check_log

ROBOT = load_planar_arm()
FRAME = make_hidden_effect_log(
    ROBOT, "torque_ripple", n_trajectories=4, duration=8.0, random_state=3
).frame


def told_of(change=None):
    frame = FRAME.copy()
    rng = np.random.default_rng(0)
    for _, own in FRAME.groupby("trajectory") if change else ():
        t = own["time"].to_numpy()
        few = np.arange(0, len(t), 5)
        for name in ("tau1", "tau2"):
            x = own[name].to_numpy()
            noise = 0.001 * np.std(x) * rng.normal(size=len(x))
            frame.loc[own.index, name] = change(t, x, few) + noise * (change is not spline)
    return {s.check: s for s in check_log(frame, ROBOT).checks if s.certainty != "noted"}


def held(t, x, few):
    return x[np.arange(len(t)) // 5 * 5]


def line(t, x, few):
    return np.interp(t, t[few], x[few])


def spline(t, x, few):
    return CubicSpline(t[few], x[few])(t)


@pytest.mark.parametrize("change, way", [(held, "held"), (line, "inter"), (spline, "inter")])
def test_torque_between_the_values_of_a_slower_bus_is_told_alone(change, way):
    told = told_of(change)
    assert list(told) == ["slow_torque"]
    rate = len(FRAME.query("trajectory == trajectory.iloc[0]")) / 8.0 / 5
    one = told["slow_torque"]
    assert f"was {way}" in one.suspicion and one.remedy.option.startswith("--resample ")
    assert float(one.remedy.option.split()[1]) == pytest.approx(rate, rel=0.05)


@pytest.mark.parametrize("step", [0.0, 0.125])
def test_torque_of_one_joint_from_a_slower_bus_is_told_alone(step):
    """Also in coarse steps, of which many follow each other anyway; it is no delay."""
    frame = make_hidden_effect_log(load_ur5(), None, n_trajectories=5, random_state=4).frame
    for _, own in frame.groupby("trajectory"):
        x = own["tau2"].to_numpy()
        x = np.round(x / step) * step if step else x
        frame.loc[own.index, "tau2"] = x[np.arange(len(x)) // 6 * 6]
    told = [s for s in check_log(frame, load_ur5()).checks if s.certainty != "noted"]
    assert [s.joints for s in told] == [(2,)]
    assert told[0].check in ("held_torque", "slow_torque")


@pytest.mark.parametrize("share_of_rate", [0.375, 0.2])
def test_hum_is_no_slower_bus_where_its_period_is_a_number_of_rows(share_of_rate):
    """Waves of the mains, sampled eight times in three periods, bend alike in every fourth row."""
    frame = FRAME.copy()
    row = frame.groupby("trajectory").cumcount()
    for k, size in (("tau1", 0.2), ("tau2", 0.1)):
        frame[k] += size * np.std(frame[k]) * np.cos(2 * np.pi * (share_of_rate + 1e-4) * row)
    assert "slow_torque" not in {s.check for s in check_log(frame, ROBOT).checks}


def test_torque_that_was_measured_in_every_row():
    assert told_of() == {}


@pytest.mark.slow
def test_joints_whose_noise_hides_the_bus_are_shown_by_the_others():
    robot = load_ur5()
    frame = make_hidden_effect_log(robot, None, n_trajectories=5, random_state=4).frame
    rng = np.random.default_rng(1)
    for _, own in frame.groupby("trajectory"):
        t = own["time"].to_numpy()
        few = np.arange(0, len(t), 6)
        for k in range(1, 7):
            x = own[f"tau{k}"].to_numpy()
            noise = 0.02 * np.std(np.diff(x[few])) * rng.normal(size=len(x))
            frame.loc[own.index, f"tau{k}"] = line(t, x, few) + noise
    told = {s.check for s in check_log(frame, robot).checks if s.certainty != "noted"}
    assert told == {"slow_torque"}


def test_rows_that_are_not_evenly_spaced_have_no_period():
    """Differences over shorter steps are larger, by their noise."""
    frame = make_hidden_effect_log(ROBOT, n_trajectories=4, random_state=3).frame
    left = frame[frame.groupby("trajectory").cumcount() % 4 < 2]
    assert "slow_torque" not in {s.check for s in check_log(left, ROBOT).checks}
