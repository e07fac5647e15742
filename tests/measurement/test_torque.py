# SPDX-License-Identifier: BSD-3-Clause
"""Torque without a sign, and torque that is late."""

import numpy as np
import pytest

from skidyn.datasets import load_scara, make_hidden_effect_log
from skidyn.logs import check_log


def test_torque_without_sign():
    robot = load_scara()
    log = make_hidden_effect_log(robot, None, n_trajectories=4, random_state=5)
    names = [f"tau{k}" for k in range(1, 5)]
    quality = check_log(log.frame.assign(**{n: log.frame[n].abs() for n in names}), robot)
    told = [s for s in quality.checks if s.check == "unsigned_torque"]
    assert told and told[0].certainty == "certain"
    assert told[0].remedy.option == "--torque-sign command"


def test_late_torque(recorded, told_of):
    assert "torque_delay" not in told_of(recorded.frame)
    frame = recorded.frame.copy()
    for _, run in recorded.frame.groupby("trajectory"):
        for name in ("tau1", "tau2"):
            frame.loc[run.index, name] = np.interp(run["time"] - 0.02, run["time"], run[name])
    delay = told_of(frame)["torque_delay"]
    assert "late" in delay.suspicion and delay.certainty == "suspected"
    assert float(delay.remedy.option.partition("=")[2]) == pytest.approx(0.02, abs=0.003)


def test_torque_cut_at_zero(signals, torque, found):
    cut = torque.copy()
    cut[:, 1] = np.maximum(cut[:, 1], 0)
    told = [s for s in found(signals, cut) if s.certainty == "certain"]
    assert [(s.check, s.joints) for s in told] == [("unsigned_torque", (2,))]
    assert told[0].remedy is None


@pytest.mark.parametrize(
    ("missing", "seed"), [(None, 5), ("spring", 7319357), ("payload", 7319354)]
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
