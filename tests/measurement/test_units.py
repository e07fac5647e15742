# SPDX-License-Identifier: BSD-3-Clause
"""Units of time and positions."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_scara, load_ur5, make_hidden_effect_log
from skidyn.logs import check_log


def test_degrees_of_positions_alone(signals, torque, found, only):
    degrees = signals.with_(q=np.rad2deg(signals.q))
    only(found(degrees, torque), "position_unit", "certain", "--units q=deg")


def test_milliseconds(signals, torque, found, only):
    only(
        found(signals.with_(time=signals.time * 1e3), torque),
        *("clock_unit", "certain", "--units time=ms"),
    )


def test_clock_at_another_rate(signals, torque, found, only):
    slow = found(signals.with_(time=2 * signals.time), torque)
    only(slow, "clock_unit", slow[0].certainty, "--gain time=0.5")


def test_positions_in_turns(signals, torque, found, only):
    only(
        found(signals.with_(q=signals.q / 2 / np.pi), torque),
        *("position_unit", "certain", "--units q=rev"),
    )


def test_counts_of_an_encoder(signals, torque, found):
    counts = np.round(signals.q * 4096 / 2 / np.pi)
    told = found(signals.with_(q=counts), torque)[0]
    assert (told.check, told.certainty) == ("position_unit", "certain")
    name, size = told.remedy.option.split("=")
    assert name == "--gain q" and float(size) == pytest.approx(2 * np.pi / 4096)


def test_time_in_minutes(signals, torque, found):
    told = found(signals.with_(time=signals.time / 60), torque)
    assert told[0].suspicion == "time looks like minutes"
    assert told[0].certainty == "certain" and told[0].remedy.option == "--units time=min"


def test_row_numbers_in_the_place_of_time(recorded, told_of):
    step = float(np.median(np.diff(recorded.frame["time"])))
    told = told_of(recorded.frame.assign(time=np.round(recorded.frame["time"] / step)))[
        "clock_unit"
    ]
    assert told.remedy.option == f"--gain time={step:g}"


def test_a_slider_in_millimetres():
    robot = load_scara()
    frame = make_hidden_effect_log(robot, None, n_trajectories=3, duration=4.0).frame
    checks = check_log(frame.assign(q3=1e3 * frame["q3"], dq3=1e3 * frame["dq3"]), robot).checks
    told = {s.check: s for s in checks}["position_unit"]
    assert told.remedy.option == "--gain q3=0.001,dq3=0.001"
    assert told.certainty == "certain" and told.joints == (3,)


@pytest.mark.parametrize("joint", [1, 2])
def test_angle_of_a_motor_on_one_joint(joint, short, told_of, only):
    names = [f"q{joint}", f"dq{joint}"]
    told = told_of(short.assign(**{name: 120 * short[name] for name in names}))
    words = ",".join(f"{name}=0.008333" for name in names)
    only(told.values(), "position_unit", "certain", f"--gain {words}")


def test_degrees_of_one_joint(short, told_of, only):
    told = told_of(short.assign(**{name: np.rad2deg(short[name]) for name in ("q2", "dq2")}))
    only(told.values(), "position_unit", "certain", "--units q2=deg,dq2=deg/s")


@pytest.mark.slow
@pytest.mark.parametrize(
    "load, joints, ratio", [(load_ur5, [5], 100.0), (load_planar_arm, [1, 2], 80.0)]
)
def test_a_gear_is_told_from_degrees_beside_a_load(load, joints, ratio):
    robot = load()
    log = make_hidden_effect_log(robot, "payload", n_trajectories=5, duration=6.0, random_state=5)
    names = [f"{q}{k}" for q in ("q", "dq") for k in joints]
    frame = log.frame.assign(**{name: ratio * log.frame[name] for name in names})
    (told,) = [s for s in check_log(frame, robot).checks if s.certainty == "certain"]
    assert told.check == "position_unit" and "degrees" not in told.suspicion
    value = float(told.remedy.option.split("=")[-1])
    assert value == pytest.approx(1 / ratio, rel=0.02)


@pytest.mark.parametrize("factor", [1.1, 1.03, 0.95])
def test_a_clock_that_is_off_by_a_little(factor, signals, torque, found, only):
    told = found(signals.with_(time=factor * signals.time), torque)
    only(told, "clock_unit", told[0].certainty, told[0].remedy.option)
    name, gain = told[0].remedy.option.split("=")
    assert name == "--gain time" and float(gain) == pytest.approx(1 / factor, rel=1e-3)
    assert "equally in all joints" in told[0].evidence


def test_a_smoothed_velocity_is_not_a_clock_that_is_off(signals, torque, found):
    wide = np.ones(31) / 31
    slow = np.column_stack([np.convolve(dq, wide, mode="same") for dq in signals.dq.T])
    assert "clock_unit" not in {s.check for s in found(signals.with_(dq=slow), torque)}


def test_one_velocity_at_another_scale_is_no_clock(signals, torque, found, only):
    told = found(signals.with_(dq=signals.dq * [1.2, 1.0]), torque)
    only(told, "velocity", "suspected", "--gain dq1=0.8333")


def test_speeds_of_motors_are_not_milliseconds(recorded, told_of, only):
    names = ["dq1", "dq2"]
    frame = recorded.frame.assign(**{n: recorded.frame[n] * 3000 / np.pi for n in names})
    told = told_of(frame)
    only(told.values(), "clock_unit", told["clock_unit"].certainty, "--gain dq=0.001047")
    assert "a gear of 100:1" in told["clock_unit"].evidence
    assert "in rpm" in told["clock_unit"].evidence
