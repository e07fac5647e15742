# SPDX-License-Identifier: BSD-3-Clause
"""A reading of a log against physical effects that could look like it."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn._signals import read_signals
from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.logs import check_log
from skidyn.measurement import Measurement, _readings
from skidyn.measurement._duel import Duel, fight
from skidyn.measurement._fits import Reading

ROBOT = load_ur5()
PLAIN = make_hidden_effect_log(ROBOT, None, n_trajectories=4, duration=6.0, random_state=2).frame
SPRUNG = make_hidden_effect_log(
    ROBOT, "coupling_spring", joints=[3, 4], n_trajectories=4, duration=6.0, random_state=2
).frame
TURNED = Reading(flip_torque=frozenset([3]), flip_motion=frozenset([3]))


def fits_of(frame, robot=ROBOT):
    tau = frame[[f"tau{k + 1}" for k in range(6)]]
    signals, torque = read_signals(frame, tau, robot)
    return Measurement(signals, torque, robot, robot.joint_names).fits


def flipped(frame):
    return frame.assign(tau3=-frame["tau3"])


@pytest.mark.parametrize("frame", [flipped(PLAIN), flipped(SPRUNG)], ids=["plain", "spring"])
def test_no_effect_takes_the_place_of_a_sign(frame):
    duel = fight(fits_of(frame), Reading(), Reading(flip_torque=frozenset([2])), [2])
    assert duel.gain > 15 and duel.beside > 15
    (told,) = [s for s in check_log(frame, ROBOT).checks if s.certainty != "noted"]
    assert told.remedy.option == "--flip tau3"


def test_an_effect_explains_more_than_a_reading():
    duel = fight(fits_of(SPRUNG), Reading(), TURNED, [3])
    assert duel.effect.lower().endswith("spring")
    assert duel.gain < 0 < duel.rival and duel.beside < 0


def test_bodies_near_those_of_the_description_are_no_other_zero():
    bodies = np.asarray(ROBOT.inertial_parameters, dtype=float).reshape(-1, 10).copy()
    bodies[-1, 1:4] = bodies[-1, 1:4] + 0.2 * np.linalg.norm(bodies[-1, 1:4])
    stated = replace(ROBOT, inertial_parameters=bodies)
    zero = Reading(zero=((5, 0.4),))
    assert fight(fits_of(PLAIN, stated), Reading(), zero, [5]).gain < 15


def test_one_of_two_is_a_note(monkeypatch):
    monkeypatch.setattr(_readings, "fight", lambda *_: Duel(40.0, 10.0, 45.0, "Coupling spring"))
    (told,) = [s for s in check_log(flipped(PLAIN), ROBOT).checks if s.check == "reading"]
    assert told.certainty == "noted" and told.remedy.option == "--flip tau3"
    assert told.suspicion.startswith("either the torque of joint 3")
    assert told.suspicion.endswith("or there is another cause: coupling spring")


def test_what_an_effect_explains_far_better_is_not_told(monkeypatch):
    monkeypatch.setattr(_readings, "fight", lambda *_: Duel(40.0, -5.0, 90.0, "Coupling spring"))
    assert all(s.check != "reading" for s in check_log(flipped(PLAIN), ROBOT).checks)
