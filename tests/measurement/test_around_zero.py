# SPDX-License-Identifier: BSD-3-Clause
"""Torque around zero: dead bands, and torque that was set to zero."""

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_scara, load_ur5, make_hidden_effect_log
from skidyn.logs import check_log
from skidyn.measurement import list_checks

LOG = make_hidden_effect_log(load_ur5(), None, n_trajectories=4, duration=4.0)
TORQUES = [f"tau{k + 1}" for k in range(6)]


def told_of(frame, robot=LOG.robot):
    return {told.check: told for told in check_log(frame, robot).checks}


def in_runs(frame, change):
    return frame.assign(**{n: frame.groupby("trajectory")[n].transform(change) for n in TORQUES})


@pytest.mark.parametrize("kept", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_current_below_a_threshold_is_zero(kept):
    tau = LOG.frame["tau1"].to_numpy()
    least = 0.2 * np.abs(tau).max()
    beyond = np.where(np.abs(tau) > least, tau if kept else tau - np.sign(tau) * least, 0.0)
    told = told_of(LOG.frame.assign(tau1=beyond))["dead_band"]
    assert told.certainty == "suspected" and told.joints == (1,)
    assert "exactly zero" in told.evidence


@pytest.mark.slow
def test_a_coarse_torque_that_passes_zero_has_no_dead_band():
    coarse = {name: np.round(LOG.frame[name] / 0.5) * 0.5 for name in TORQUES}
    assert "dead_band" not in told_of(LOG.frame.assign(**coarse))


def test_a_drive_that_is_switched_off_has_no_dead_band():
    frame = LOG.frame.copy()
    frame.loc[150:300, "tau1"] = 0.0
    assert "dead_band" not in told_of(frame)


@pytest.mark.parametrize(
    "change, words",
    [(lambda x: x - x.iloc[:5].mean(), "start of every"), (lambda x: x - x.mean(), "zero mean")],
)
def test_torque_that_was_set_to_zero_for_each_recording(change, words):
    told = told_of(in_runs(LOG.frame, change))
    assert words in told["tared_torque"].suspicion
    # what is left of gravity is no reading of joints or units
    assert not {"reading", "odd_recording", "unexplained", "torque_scale"} & set(told)


@pytest.mark.slow
def test_torque_without_gravity_was_not_tared():
    robot = LOG.robot
    pull = robot.gravity_torque(LOG.frame[[f"q{k + 1}" for k in range(6)]].to_numpy())
    changes = dict(zip(TORQUES, (LOG.frame[TORQUES].to_numpy() - pull).T, strict=True))
    told = told_of(LOG.frame.assign(**changes))
    assert "tared_torque" not in told and "reading" in told


def test_robots_that_hold_no_weight_start_from_zero():
    log = make_hidden_effect_log(load_scara(), None, n_trajectories=3, duration=4.0)
    assert not {"tared_torque", "dead_band"} & set(told_of(log.frame, log.robot))


def test_motor_torque_of_a_slider_was_not_tared():
    log = make_hidden_effect_log(load_scara(), None, n_trajectories=3, duration=4.0)
    small = {f"tau{k + 1}": log.frame[f"tau{k + 1}"] / 100 for k in range(4)}
    assert "tared_torque" not in told_of(log.frame.assign(**small), log.robot)


def test_no_effect_is_named_while_these_are_suspected():
    assert all(c.misnames for c in list_checks() if c.name in ("dead_band", "tared_torque"))


def counted_from(first):
    """Positions less those of a row of their recording, which begins there."""
    q = [f"q{k + 1}" for k in range(6)]
    frame = LOG.frame[LOG.frame.groupby("trajectory").cumcount() >= first].reset_index(drop=True)
    return frame.assign(
        **{n: frame.groupby("trajectory")[n].transform(lambda x: x - x.iloc[0]) for n in q}
    )


def test_positions_that_are_zero_where_recordings_begin_in_motion_are_counted_from_there():
    told = told_of(counted_from(40))["counted_position"]
    assert told.certainty == "suspected" and told.joints == tuple(range(1, 7))
    assert "although the joints move" in told.evidence


def test_recordings_that_begin_at_rest_in_the_zero_pose_are_as_they_should_be():
    t = np.arange(300) / 100.0
    sizes = np.random.default_rng(0).uniform(-1.0, 1.0, (4, 6))
    q, dq, ddq = (
        np.vstack([np.outer(of_time, size) for size in sizes])
        for of_time in (1 - np.cos(2 * t), 2 * np.sin(2 * t), 4 * np.cos(2 * t))
    )
    tau = LOG.robot.inverse_dynamics(q, dq, ddq) + 0.5 * np.sign(dq)
    names = [f"{symbol}{k + 1}" for symbol in ("q", "dq", "tau") for k in range(6)]
    frame = pd.DataFrame(np.hstack([q, dq, tau]), columns=names)
    frame["trajectory"], frame["time"] = np.repeat(range(4), len(t)), np.tile(t, 4)

    assert "counted_position" not in told_of(frame)
