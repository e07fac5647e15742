# SPDX-License-Identifier: BSD-3-Clause
"""Torque that is late in all joints or in one."""

import warnings

import numpy as np
import pytest

from skidyn.datasets import load_scara, load_ur5, make_hidden_effect_log
from skidyn.logs import check_log
from skidyn.robots import Robot

#: A robot of one joint.
PENDULUM = """<robot name="one"><link name="base"/><link name="arm"><inertial>
<origin xyz="0 0 0.3"/><mass value="2"/>
<inertia ixx="0.05" iyy="0.05" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="swing" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="40" velocity="4"/></joint></robot>"""


def test_late_torque(recorded, told_of):
    assert "torque_delay" not in told_of(recorded.frame)
    frame = recorded.frame.copy()
    for _, run in recorded.frame.groupby("trajectory"):
        for name in ("tau1", "tau2"):
            frame.loc[run.index, name] = np.interp(run["time"] - 0.02, run["time"], run[name])
    delay = told_of(frame)["torque_delay"]
    assert "late" in delay.suspicion and delay.certainty == "suspected"
    assert float(delay.remedy.option.partition("=")[2]) == pytest.approx(0.02, abs=0.003)


@pytest.mark.parametrize(
    ("missing", "seed"),
    [
        (None, 5),
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            for case in [("spring", 7319357), ("payload", 7319354)]
        ),
    ],
)
def test_torque_of_one_joint_that_is_late(arm, told_of, missing, seed):
    """A spring that is missing, or loads of single recordings, do not hide its lag."""
    log = make_hidden_effect_log(arm, missing, n_trajectories=5, duration=6.0, random_state=seed)
    late = log.frame.groupby("trajectory")["tau2"].shift(3).bfill()
    told = told_of(log.frame.assign(tau2=late))["torque_delay"]
    assert told.joints == (2,) and told.remedy.option.startswith("--late tau2=0.0")


def test_a_delay_between_two_samples_is_no_low_pass():
    robot = load_scara()
    frame = make_hidden_effect_log(robot, None, n_trajectories=5, random_state=7319254).frame
    names = [f"tau{k}" for k in range(1, 5)]
    for _, run in frame.groupby("trajectory"):
        for name in names:
            frame.loc[run.index, name] = np.interp(run["time"] - 0.014, run["time"], run[name])
    told = {s.check: s for s in check_log(frame, robot).checks}["torque_delay"]
    assert told.remedy.option.startswith("--late tau=0.01")


def test_coarse_positions_are_not_late(arm, told_of):
    log = make_hidden_effect_log(arm, None, n_trajectories=5, duration=6.0, random_state=7431219)
    step = 2 * np.pi / 4096
    coarse = {name: np.round(log.frame[name] / step) * step for name in ("q1", "q2")}
    assert "torque_delay" not in told_of(log.frame.assign(**coarse))


@pytest.mark.slow
def test_a_clock_that_drifts_a_little_is_told_from_a_constant_lag():
    """By 4 ms per second; the lags in the halves of the recordings differ by less than 4 ms."""
    robot = load_ur5()
    options = {"n_trajectories": 5, "duration": 6.0, "random_state": 6610131}
    log = make_hidden_effect_log(robot, None, **options)
    frame = log.frame.copy()
    for _, run in log.frame.groupby("trajectory"):
        since = run["time"] - run["time"].iloc[0]
        for name in (f"tau{k + 1}" for k in range(6)):
            frame.loc[run.index, name] = np.interp(
                run["time"] - 3.9e-3 * since, run["time"], run[name]
            )
    told = {s.check: s for s in check_log(frame, robot).checks}["torque_delay"]
    assert told.suspicion.startswith("the clock of the torque runs at a different rate")
    growth = float(told.remedy.option.partition("+")[2].removesuffix("*t"))
    assert growth == pytest.approx(3.9e-3, rel=0.05)


def test_a_single_joint_brings_no_warnings_of_numpy():
    one = Robot.from_urdf(PENDULUM)
    log = make_hidden_effect_log(one, None, n_trajectories=4, duration=6.0, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        check_log(log.frame, one)
