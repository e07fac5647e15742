# SPDX-License-Identifier: BSD-3-Clause
"""Torque around zero: dead bands, and torque that was set to zero."""

import numpy as np
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
