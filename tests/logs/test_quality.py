# SPDX-License-Identifier: BSD-3-Clause
"""The quality report of a log."""

import json

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_planar_arm, make_hidden_effect_log
from skidyn.logs import check_log, read_log

PANDA = load_panda()
LOG = make_hidden_effect_log(PANDA, None, n_trajectories=4, duration=6.0)


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
