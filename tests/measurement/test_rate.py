# SPDX-License-Identifier: BSD-3-Clause
"""Clock and velocities at another rate."""

import numpy as np
import pytest

from skidyn.datasets import (
    load_planar_arm,
    load_ur5,
    make_hidden_effect_log,
)
from skidyn.logs import check_log


@pytest.mark.parametrize("factor", [0.5, pytest.param(4.0, marks=pytest.mark.slow)])
def test_a_rate_that_is_wrong_in_clock_and_velocities(factor, told_of):
    robot = load_ur5()
    frame = make_hidden_effect_log(
        robot, None, n_trajectories=4, duration=4.0, random_state=3
    ).frame
    velocities = {f"dq{k}": frame[f"dq{k}"] / factor for k in range(1, 7)}
    told = told_of(frame.assign(time=factor * frame["time"], **velocities), robot)["torque_scale"]
    assert told.suspicion.startswith("the clock runs at a different rate")
    words = dict(pair.split("=") for pair in told.remedy.option.split(" ")[1].split(","))
    assert float(words["time"]) == pytest.approx(1 / factor, rel=0.1)
    assert float(words["dq"]) == pytest.approx(factor, rel=0.1)


@pytest.mark.parametrize(
    ("factor", "log"),
    [
        (0.5, {"n_trajectories": 6, "duration": 8.0, "random_state": 23}),
        (2.0, {"n_trajectories": 5, "duration": 6.0, "random_state": 7319358}),
    ],
)
def test_a_rate_that_leaves_the_scale_of_every_torque(factor, log):
    robot = load_planar_arm()
    frame = make_hidden_effect_log(robot, None, **log).frame
    speeds = {n: frame[n] / factor for n in ("dq1", "dq2")}
    frame = frame.assign(time=frame["time"] * factor, **speeds)
    (told,) = [s for s in check_log(frame, robot).checks if s.certainty != "noted"]
    assert told.remedy.option == f"--gain time={1 / factor:g},dq={factor:g}"


def test_a_torque_of_gravity_alone_is_no_other_rate(told_of):
    robot = load_ur5()
    frame = make_hidden_effect_log(
        robot, None, n_trajectories=4, duration=4.0, random_state=3
    ).frame
    pull = robot.gravity_torque(frame[[f"q{k}" for k in range(1, 7)]].to_numpy())
    pull += np.random.default_rng(0).normal(0.0, 0.02, pull.shape)
    told = told_of(frame.assign(**{f"tau{k + 1}": pull[:, k] for k in range(6)}), robot)
    assert "contains gravity only" in told["gravity_only"].suspicion
    assert "torque_scale" not in told
