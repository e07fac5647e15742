# SPDX-License-Identifier: BSD-3-Clause
"""The quality report of a log."""

import json

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_planar_arm, make_hidden_effect_log
from skidyn.logs import check_log, read_log

PANDA = load_panda()
LOG = make_hidden_effect_log(PANDA, None, n_trajectories=4, duration=6.0)
PLANAR = load_planar_arm()
PLAIN = make_hidden_effect_log(PLANAR, None, n_trajectories=3, duration=4.0).frame


def test_good_log_raises_no_suspicion():
    quality = check_log(LOG.frame, PANDA)
    assert quality.warnings == ()
    assert quality.rate == pytest.approx(100) and quality.jitter < 1e-6
    assert (quality.gaps, quality.repeated_rows, quality.n_trajectories) == (0, 0, 4)
    assert quality.duration == pytest.approx(4 * 5.99)
    for joint in quality.joints:
        assert joint.velocity_slope == pytest.approx(1, abs=0.01)
        assert joint.resolution == pytest.approx(2 * np.pi / 2**17, rel=0.02)
        assert 0 < joint.position_coverage < 1 and joint.excited and joint.reversals > 5


@pytest.mark.slow
def test_delay_is_measured():
    late = make_hidden_effect_log(PANDA, "time_delay", n_trajectories=4, duration=6.0)
    quality = check_log(late.frame, PANDA)
    delays = [joint.torque_delay for joint in quality.joints]
    assert np.median(delays) == pytest.approx(late.parameters["delay"], abs=0.002)
    assert any(
        "torque is late relative to the motion by about" in text for text in quality.warnings
    )


def test_report_as_dict_and_text():
    quality = check_log(LOG.frame)
    told = json.loads(json.dumps(quality.to_dict(), allow_nan=False))
    assert told["n_samples"] == 2400 and told["joints"][0]["position_coverage"] is None
    assert "2400 samples in 4 trajectories" in str(quality) and "panda_joint7" in str(quality)


def test_frame_is_left_as_it_was():
    before = LOG.frame.copy()
    check_log(LOG.frame, PANDA)
    assert LOG.frame.equals(before)


def test_jitter_of_two_rates_is_not_confused():
    frame = LOG.frame.copy()
    second = frame["trajectory"] == 1
    start = frame.loc[second, "time"].iloc[0]
    frame.loc[second, "time"] = start + 2 * (frame.loc[second, "time"] - start)
    frame.loc[second, [f"dq{k}" for k in range(1, 8)]] /= 2
    assert check_log(frame).jitter < 1e-6


def test_slow_sampling_is_told():
    robot = load_planar_arm()
    log = make_hidden_effect_log(robot, None, n_trajectories=2, duration=20.0, rate=10.0)
    assert any("sampled at 10 Hz" in text for text in check_log(log.frame).warnings)


def test_stale_rows_of_a_real_log(data_dir):
    frame = read_log(data_dir / "dvrk" / "dvrk_mtm.npz", check=False)
    quality = check_log(frame)
    assert 0.1 < quality.repeated_rows / quality.n_samples < 0.2


def test_gaps_are_counted():
    gap = PLAIN.drop(index=range(100, 200))
    quality = check_log(gap)
    assert quality.gaps == 1
    assert any(
        "1 gap(s) in time inside trajectories: the longest lasts 1.01 s" in w
        for w in quality.warnings
    )


def test_stale_rows_are_counted():
    stale = PLAIN.copy()
    signals = [name for name in PLAIN.columns if name[0] in "qd"]
    stale.loc[1::2, signals] = PLAIN.loc[0::2, signals].to_numpy()
    quality = check_log(stale)
    assert quality.repeated_rows > 0.8 * len(PLAIN) / 2
    assert any("no position changes although joints move" in text for text in quality.warnings)


def test_single_trajectory_is_told():
    quality = check_log(PLAIN[PLAIN["trajectory"] == 1])
    assert any("single trajectory" in text for text in quality.notes)
    assert not check_log(PLAIN).notes


def test_constant_joint_and_constant_torque_are_told():
    quality = check_log(PLAIN.assign(q1=0.3, dq1=0.0, tau2=1.0), PLANAR)
    assert any("joint 1 (joint1) hardly moves" in text for text in quality.warnings)
    assert any("torque of joint 2 (joint2) is constant" in text for text in quality.warnings)


def test_saturated_torque_is_told():
    limit = PLAIN["tau1"].abs().quantile(0.9)
    quality = check_log(PLAIN.assign(tau1=PLAIN["tau1"].clip(-limit, limit)))
    assert any("(joint1) stays at its extreme value" in text for text in quality.warnings)


def test_degrees_are_suspected_with_the_evidence():
    panda = load_panda()
    log = make_hidden_effect_log(panda, None, n_trajectories=2, duration=4.0).frame
    angles = [f"{name}{k}" for name in ("q", "dq") for k in range(1, 8)]
    log[angles] = np.rad2deg(log[angles])
    told = [text for text in check_log(log, panda).warnings if "degrees" in text]
    assert len(told) == 1 and "where the limit is" in told[0] and "units={'q': 'deg'," in told[0]


@pytest.mark.parametrize(
    "change, unit",
    [
        ({"time": 1e3}, "time looks like ms"),
        ({"time": 1e9}, "time looks like ns"),
        ({"dq1": 57.29578, "dq2": 57.29578}, "velocities look like deg/s"),
        ({"q1": 57.29578, "q2": 57.29578}, "positions look like degrees"),
        ({"dq1": -1.0, "dq2": -1.0}, "has the opposite sign"),
        ({"dq1": 1.6, "dq2": 1.6}, "is not the derivative"),
    ],
)
def test_inconsistent_units_are_suspected(change, unit):
    other = PLAIN.assign(**{name: PLAIN[name] * factor for name, factor in change.items()})
    assert any(unit in text for text in check_log(other).warnings)


@pytest.mark.slow
def test_currents_passed_as_torques_are_suspected():
    panda = load_panda()
    log = make_hidden_effect_log(panda, None, n_trajectories=3, duration=5.0).frame
    torques = [f"tau{k}" for k in range(1, 8)]
    assert not [text for text in check_log(log, panda).warnings if "currents" in text]
    log[torques] /= 9.0
    told = [text for text in check_log(log, panda).warnings if "motor currents" in text]
    assert len(told) == 1 and "panda_joint2 0.1" in told[0]


def test_the_numbers_of_a_log_are_known_before_its_checks():
    seen = []
    quality = check_log(PLAIN.assign(dq2=-PLAIN["dq2"]), PLANAR, measured=seen.append)
    (first,) = seen
    assert not first.checks and quality.checks
    parts = first.motion_table, quality.torque_table, quality.problems
    assert str(quality) == "\n\n".join(parts)


@pytest.mark.parametrize("n_rows", [2, 3, 10])
def test_few_rows_are_enough_for_a_report(n_rows):
    quality = check_log(PLAIN.iloc[:n_rows], PLANAR)
    assert quality.n_samples == n_rows
    assert not any(joint.excited for joint in quality.joints)


@pytest.mark.parametrize("given", ["log.csv", PLAIN.to_numpy()])
def test_only_a_table_is_checked(given):
    with pytest.raises(ValueError, match=r"expected a DataFrame.*check_log\(read_log"):
        check_log(given)
