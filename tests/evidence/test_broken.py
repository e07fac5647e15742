# SPDX-License-Identifier: BSD-3-Clause
"""Samples that leap away and back are found, told and left out; jumps of dry friction are not."""

from __future__ import annotations

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.effects import Signals
from skidyn.evidence import broken_notes
from skidyn.exceptions import LogWarning
from skidyn.identification import RBDRegressor
from skidyn.logs import check_log


def swing(n=2000, rate=200.0):
    t = np.arange(n) / rate
    q, dq = np.sin(3 * t)[:, None], 3 * np.cos(3 * t)[:, None]
    return Signals(q, dq, -9 * q, np.arange(n) // (n // 2), t, None, np.array([False]))


def friction(signals, noise=0.05):
    rng = np.random.default_rng(0)
    return 2 * np.sign(signals.dq) + signals.q + noise * rng.normal(size=signals.q.shape)


def notes(signals, torque):
    return [f"{what} {where}" for what, where in broken_notes(signals, torque, ("elbow",))]


def test_a_dropped_packet_at_either_end_or_within_is_found():
    signals = swing()
    torque = friction(signals)
    torque[[0, 500, 501, 1999]] = 9.0

    (note,) = notes(signals, torque)

    assert "4 samples" in note and "row 0" in note


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.5])
def test_the_jumps_of_dry_friction_are_no_leaps(noise):
    signals = swing()

    assert broken_notes(signals, friction(signals, noise), ("elbow",)) == []


def test_a_signal_at_rest_has_no_leaps():
    signals = swing()

    assert broken_notes(signals, np.zeros_like(signals.q), ("elbow",)) == []


def test_a_recording_that_begins_with_motion_and_rests_has_no_leaps():
    signals = swing()
    q = signals.q.copy()
    q[1000:] = 0.3 - 0.03 * np.exp(-np.arange(1000) / 5.0)[:, None]
    assert broken_notes(signals.with_(q=q), np.zeros((2000, 1)), ("joint",)) == []


def test_the_note_names_joint_row_and_value():
    signals = swing()
    torque = friction(signals)
    torque[700] = 40.0

    (note,) = notes(signals, torque)

    assert all(word in note for word in ("torque", "joint 1 (elbow)", "1 sample", "row 700", "40"))


def test_the_fit_is_that_without_the_broken_samples_and_says_so():
    log = make_hidden_effect_log(load_planar_arm(), None, noise="low", random_state=3)
    torque = np.array(log.y)
    torque[::977] += 500.0
    clean = RBDRegressor(log.robot).fit(log.X, log.y)

    with pytest.warns(LogWarning, match="has outliers") as caught:
        model = RBDRegressor(log.robot).fit(log.X, torque)
    frame = log.frame.assign(tau1=torque[:, 0], tau2=torque[:, 1])
    told = {str(check) for check in check_log(frame, log.robot).checks}
    assert {str(warning.message) for warning in caught} <= told  # in the same words

    assert np.allclose(model.coef_, clean.coef_, rtol=0.02, atol=0.02 * np.abs(clean.coef_).max())


def test_a_broken_position_spoils_no_more_than_its_surroundings():
    log = make_hidden_effect_log(load_planar_arm(), None, noise="low", random_state=3)
    X = log.X.copy()
    X.loc[[700, 1900], "q2"] = 0.0
    X.loc[[700, 1900], "q2"] += X["q2"].max() + 1.0
    clean = RBDRegressor(log.robot).fit(log.X, log.y)

    with pytest.warns(LogWarning, match="position of joint 2"):
        model = RBDRegressor(log.robot).fit(X, log.y)

    assert np.allclose(model.coef_, clean.coef_, rtol=0.02, atol=0.02 * np.abs(clean.coef_).max())


def test_a_moment_of_motion_the_other_way_is_no_leap():
    signals = swing()
    dq = signals.dq.copy()
    dq[500:502] *= -1.0
    signals = signals.with_(dq=dq)
    torque = friction(signals)

    def told(torque):
        return [n for n in notes(signals, torque) if "torque" in n]

    assert told(torque) == []
    broken = torque.copy()
    broken[501] = 60.0
    (note,) = told(broken)
    assert "1 sample" in note and "row 501" in note


def test_a_small_jump_of_a_position_is_found():
    signals = swing()
    q = signals.q.copy()
    q[700] += 0.01  # 0.5 % of its range

    (note,) = notes(signals.with_(q=q), friction(signals))

    assert "joint 1 (elbow) jumps or disagrees" in note and "row 699" in note


def test_samples_between_a_jump_and_one_back_are_broken():
    signals = swing()
    q = signals.q.copy()
    q[600:630] = 0.0

    (note,) = notes(signals.with_(q=q), friction(signals))

    assert "jumps" in note and int(note.split(" samples")[0].split()[-1]) >= 30


def test_held_samples_are_found():
    signals = swing()
    held = np.arange(2000)
    held[300:315] = 300
    stale = signals.with_(q=signals.q[held], dq=signals.dq[held])

    (note,) = notes(stale, friction(signals)[held])

    assert "disagrees with the velocity" in note


def test_ends_that_a_filter_bent_are_found():
    signals = swing()
    q = signals.q.copy()
    q[992:1000] = q[992]  # as a filter does that continues the last value

    (note,) = notes(signals.with_(q=q), friction(signals))

    assert "joint 1 (elbow) jumps or disagrees" in note


@pytest.mark.parametrize("bend", ["corner", "rest", "steps"])
def test_a_sudden_change_of_velocity_or_a_coarse_encoder_is_no_jump(bend):
    t = np.arange(2000) / 200.0
    dq = {"corner": np.sign(np.cos(2 * t)), "rest": (t > 8) * 1.0, "steps": np.cos(t)}[bend]
    q = np.cumsum(dq) / 200.0
    if bend == "steps":
        q = np.round(q / 1e-3) * 1e-3
    signals = Signals(
        q[:, None], dq[:, None], 0 * dq[:, None], np.zeros(2000, int), t, None, np.array([False])
    )

    assert notes(signals, np.zeros((2000, 1))) == []


def test_a_log_with_held_and_broken_positions_has_no_effect():
    log = make_hidden_effect_log(load_planar_arm(), None, noise="low", random_state=3)
    X, y = log.X.copy(), np.array(log.y)
    X.loc[[700, 1900], "q2"] += 0.02
    for row in (400, 1200, 2500):
        motion = [c for c in X if c not in ("time", "trajectory")]
        X.loc[row : row + 8, motion] = X.loc[row, motion].to_numpy()
        y[row : row + 9] = y[row]

    found = diagnose(RBDRegressor(log.robot), X, y)

    assert found.verdict == "complete"
