# SPDX-License-Identifier: BSD-3-Clause
"""Torque without a sign, or cut at zero."""

import numpy as np

from skidyn.datasets import load_scara, load_ur5, make_hidden_effect_log
from skidyn.logs import check_log


def test_torque_without_sign():
    robot = load_scara()
    log = make_hidden_effect_log(robot, None, n_trajectories=4, random_state=5)
    names = [f"tau{k}" for k in range(1, 5)]
    quality = check_log(log.frame.assign(**{n: log.frame[n].abs() for n in names}), robot)
    told = [s for s in quality.checks if s.check == "unsigned_torque"]
    assert told and told[0].certainty == "certain"
    assert told[0].remedy.option == "--torque-sign command"


def test_torque_cut_at_zero(signals, torque, found):
    cut = torque.copy()
    cut[:, 1] = np.maximum(cut[:, 1], 0)
    told = [s for s in found(signals, cut) if s.certainty == "certain"]
    assert [(s.check, s.joints) for s in told] == [("unsigned_torque", (2,))]
    assert told[0].remedy is None


def test_a_magnitude_with_the_sign_of_the_velocity(signals, torque, found):
    def told_of(columns):
        told = [s for s in found(signals, columns) if s.check == "unsigned_torque"]
        return [(s.certainty, s.joints) for s in told]

    assert told_of(torque) == []
    # bodies never oppose the motion of joint 2 by much
    assert told_of(np.abs(torque) * np.sign(signals.dq)) == [("suspected", (1,))]


def test_friction_of_a_wrist_with_light_links_is_no_magnitude():
    robot = load_ur5()
    log = make_hidden_effect_log(robot, None, n_trajectories=4, duration=4.0)
    assert not [s for s in check_log(log.frame, robot).checks if s.check == "unsigned_torque"]
