# SPDX-License-Identifier: BSD-3-Clause
"""Single channels: still, coarse, cut off, not enabled, without noise."""

import numpy as np
import pytest

from skidyn.diagnosis import diagnose
from skidyn.exceptions import LogError
from skidyn.identification import RBDRegressor
from skidyn.logs import check_log, read_log


def test_saturation(signals, torque, found):
    limit = 0.8 * np.abs(torque[:, 0]).max()
    cut = np.column_stack([np.clip(torque[:, 0], -limit, limit), torque[:, 1]])
    told = {s.check: s for s in found(signals, cut)}
    assert told["clipped_torque"].joints == (1,)


def test_still_joint(signals, torque, found):
    still = signals.with_(q=signals.q * [1, 0], dq=signals.dq * [1, 0])
    told = {s.check: s for s in found(still, torque)}
    assert told["still_joint"].joints == (2,) and "elbow" in str(told["still_joint"])


def test_torque_in_coarse_steps(signals, torque, found):
    step = 0.8 * torque[:, 0].std()
    coarse = np.column_stack([np.round(torque[:, 0] / step) * step, torque[:, 1]])
    told = {s.check: s for s in found(signals, coarse)}
    assert told["coarse_torque"].joints == (1,) and told["coarse_torque"].certainty == "noted"
    assert "clipped_torque" not in told


def test_coarse_torques_are_one_line(signals, torque, found):
    step = 0.6 * torque.std(axis=0)
    (told,) = [s for s in found(signals, np.round(torque / step) * step) if "steps" in s.suspicion]
    assert told.joints == (1, 2) and "shoulder) and joint 2 (elbow)" in told.suspicion
    assert told.evidence.count("N m (") == 2
    assert not [s for s in found(signals.take(slice(12)), torque[:12]) if "coarse" in s.check]


def test_velocities_in_coarse_steps(signals, torque, found):
    step = 0.3 * signals.dq[:, 0].std()
    coarse = signals.dq.copy()
    coarse[:, 0] = np.trunc(coarse[:, 0] / step) * step
    told = {s.check: s for s in found(signals.with_(dq=coarse), torque)}
    assert told["coarse_velocity"].remedy.option == "--derive dq1"
    assert told["coarse_velocity"].certainty == "noted"


def test_torque_without_noise(arm, signals, found):
    smooth = arm.inverse_dynamics(signals.q, signals.dq, signals.ddq) + 0.8 * signals.dq
    assert "smooth_torque" in [s.check for s in found(signals, smooth, None)]
    noisy = smooth + np.random.default_rng(0).normal(0, 1e-3, smooth.shape)
    assert found(signals, noisy, None) == []


def test_positions_in_half_precision(recorded, told_of):
    short = {name: recorded.frame[name].astype(np.float16).astype(float) for name in ("q1", "q2")}
    assert told_of(recorded.frame.assign(**short))["coarse_position"].joints == (1, 2)


@pytest.mark.parametrize("backwards", [False, True])
def test_torque_before_drives_are_enabled(backwards, arm, recorded, tmp_path):
    frame = recorded.frame.copy()
    for rows in frame.groupby("trajectory").groups.values():
        frame.loc[rows[-40:] if backwards else rows[:40], ["tau1", "tau2"]] = 0.0
    told = [s for s in check_log(frame, arm).checks if s.certainty != "noted"]
    assert [s.check for s in told] == ["constant_torque"] and told[0].certainty == "certain"
    assert "in 160 rows" in told[0].evidence and told[0].remedy.option == "--drop-repeated"
    frame.to_parquet(tmp_path / "log.parquet")
    kept = read_log(tmp_path / "log.parquet", robot=arm, drop_repeated=True)
    assert len(kept) == len(frame) - 160 and (kept[["tau1", "tau2"]] != 0).all(axis=None)


def test_positions_that_leap_to_zero_spoil_no_other_check(recorded, told_of):
    frame = recorded.frame.copy()
    lost = np.random.default_rng(0).random(len(frame)) < 0.005
    frame.loc[lost, ["q1", "q2"]] = 0.0
    told = told_of(frame)
    assert told.pop("failed_reads").remedy.option == "--placeholder q=0"
    assert {s.certainty for s in told.values()} <= {"noted"}


def test_a_torque_of_one_sign_before_drives_are_enabled_is_not_cut(recorded, told_of):
    frame = recorded.frame.copy()
    frame["tau2"] = frame["tau2"].abs() + 1.0
    for rows in frame.groupby("trajectory").groups.values():
        frame.loc[rows[:40], ["tau1", "tau2"]] = 0.0
    told = told_of(frame)
    assert told["constant_torque"].certainty == "certain"
    assert "is clipped at zero" not in str(told.get("unsigned_torque", ""))


def test_a_dead_band_explains_zeros_at_the_ends(recorded, told_of):
    frame = recorded.frame.copy()
    for name in ("tau1", "tau2"):
        least = 0.15 * frame[name].abs().quantile(0.95)
        frame[name] = frame[name].where(frame[name].abs() >= least, 0.0)
    frame.loc[frame.groupby("trajectory").head(12).index, ["tau1", "tau2"]] = 0.0
    told = told_of(frame)
    assert "dead_band" in told and "constant_torque" not in told


def test_ends_that_were_filled_with_the_last_values_of_all_channels_are_left_out(recorded, told_of):
    frame = recorded.frame.copy()
    channels = [name for name in frame.columns if name not in ("time", "trajectory")]
    for rows in frame.groupby("trajectory").groups.values():
        filled = rows[-60:]
        frame.loc[filled, channels] = frame.loc[filled[0], channels].to_numpy()

    told = told_of(frame)

    assert told["constant_torque"].remedy.option == "--drop-repeated"
    assert {check for check, s in told.items() if s.certainty != "noted"} == {"constant_torque"}


@pytest.mark.parametrize("value", [0.0, 1.3])
def test_a_torque_that_never_changes_was_not_recorded(value, arm, recorded):
    frame = recorded.frame.assign(tau1=value, tau2=-value)
    for robot in (arm, None):
        (told,) = check_log(frame, robot).checks
        assert (told.check, told.certainty, told.remedy) == ("unrecorded_torque", "certain", None)
    assert "nan" not in str(check_log(frame, arm))
    with pytest.raises(LogError, match="wrong. The torque was not recorded"):
        diagnose(RBDRegressor(arm), frame, frame[["tau1", "tau2"]])
    with pytest.raises(LogError, match="every torque is zero"):
        diagnose(RBDRegressor(arm), frame, np.zeros((len(frame), 2)), force=True)


def test_a_torque_that_does_not_change_at_rest_is_not_missing(signals, found):
    rests = signals.with_(q=0 * signals.q, dq=0 * signals.dq, ddq=0 * signals.dq)
    told = {s.check: s.certainty for s in found(rests, np.full(rests.q.shape, 1.3))}
    assert told == {"constant_torque": "suspected", "still_joint": "noted"}
