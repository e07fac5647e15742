# SPDX-License-Identifier: BSD-3-Clause
"""Positions and torques that hold their last value, and zeros for missing torques."""

import numpy as np


def test_torques_that_are_held(signals, torque, found, only):
    held = torque[np.arange(len(torque)) // 4 * 4]
    only(found(signals, held), "held_torque", "certain", "--drop-repeated")


def test_a_position_that_is_reported_less_often(signals, torque, found):
    slow = signals.q.copy()
    slow[:, 1] = slow[np.arange(len(slow)) // 8 * 8, 1]
    told = {s.check: s for s in found(signals.with_(q=slow), torque)}
    assert told["held_position"].joints == (2,)
    assert told["held_position"].remedy.option.startswith("--resample 1")
    assert "lost_rows" not in told


def test_a_position_that_is_stuck_for_a_while(signals, torque, found):
    stuck = signals.q.copy()
    stuck[700:900, 0] = stuck[700, 0]
    told = [s for s in found(signals.with_(q=stuck), torque) if s.certainty == "certain"]
    assert [s.joints for s in told] == [(1,)] and "stuck" in told[0].suspicion


def test_a_velocity_of_a_slow_bus_in_few_digits(signals, torque, found):
    slow = signals.dq.round(2)
    slow[:, 1] = slow[np.arange(len(slow)) // 5 * 5, 1]
    told = {s.check: s for s in found(signals.with_(dq=slow), torque)}
    assert told["held_velocity"].joints == (2,)


def test_a_position_at_rest_beside_another_signal_as_its_velocity(signals, torque, found):
    resting = signals.q[np.r_[:700, np.full(200, 700), 701:1801]]
    velocity = signals.dq.copy()
    velocity[:, 0] = torque[:, 0]
    told = found(signals.with_(q=resting, dq=velocity), torque)
    assert not any("stuck" in s.suspicion for s in told)


def test_a_torque_that_is_stuck_for_a_while(signals, torque, found):
    stuck = torque.copy()
    stuck[700:900, 0] = stuck[700, 0]
    told = [s for s in found(signals, stuck) if s.check == "stuck_torque"]
    assert [s.joints for s in told] == [(1,)]
    assert "from 7 s to 8.99 s" in told[0].evidence


def test_missing_torques_that_were_replaced_by_zero(signals, torque, found):
    lost = np.random.default_rng(0).choice(len(torque) - 10, 60, replace=False)
    holes = torque.copy()
    for start in lost:
        holes[start : start + 8] = 0.0
    told = {s.check: s for s in found(signals, holes)}
    assert told["missing_torque"].joints == (1, 2)
    assert told["missing_torque"].remedy.option == "--placeholder tau=0"
    assert "dead_band" not in told


def test_zeros_of_one_joint(signals, torque, found):
    holes = torque.copy()
    begins = np.random.default_rng(1).choice(len(torque) - 10, 40, replace=False)
    holes[(begins[:, None] + np.arange(8)).ravel(), 0] = 0.0
    told = {s.check: s for s in found(signals, holes)}
    assert told["missing_torque"].joints == (1,)


def test_single_zeros_are_told_as_failed_reads_only(signals, torque, found):
    holes = torque.copy()
    holes[np.random.default_rng(1).choice(len(torque), 40, replace=False), 0] = 0.0
    told = {s.check: s for s in found(signals, holes)}
    assert told["failed_reads"].joints == (1,) and "missing_torque" not in told


def test_a_wide_dead_band_is_neither_held_nor_missing(recorded, told_of):
    torque = recorded.frame[["tau1", "tau2"]]
    band = torque.where(torque.abs() > 0.2 * torque.abs().quantile(0.95), 0.0)
    told = set(told_of(recorded.frame.assign(tau1=band["tau1"], tau2=band["tau2"])))
    assert "dead_band" in told and not told & {"held_torque", "missing_torque"}


def test_lost_samples_of_a_nearly_constant_torque_are_failed_reads(signals, torque, found):
    """They are no jumps from one end of its range to the other."""
    holes = torque.copy()
    holes[:, 0] = 15 + 0.01 * torque[:, 0]
    holes[np.random.default_rng(1).choice(len(torque), 40, replace=False), 0] = 0.0
    told = {s.check: s for s in found(signals, holes)}
    assert told["failed_reads"].joints == (1,) and "overflowed_torque" not in told


def test_zeros_of_a_coarse_torque_with_noise_are_not_missing(signals, torque, found):
    noise = np.random.default_rng(1).normal(0, 0.8, torque.shape)
    coarse = np.round((torque + noise) / 0.3) * 0.3
    told = {s.check for s in found(signals, coarse)}
    assert "missing_torque" not in told


def test_a_torque_of_a_slow_bus_in_fine_steps(signals, torque, found):
    slow = torque.copy()
    slow[:, 1] = slow[np.arange(len(slow)) // 25 * 25, 1]
    told = {s.check: s for s in found(signals, np.round(slow, 2))}
    assert told["held_torque"].joints == (2,)


def test_velocities_of_a_slow_bus(signals, torque, found):
    slow = signals.dq.copy()
    slow[:, 0] = slow[np.arange(len(slow)) // 20 * 20, 0]
    told = {s.check: s for s in found(signals.with_(dq=slow), torque)}
    assert told["held_velocity"].joints == (1,)
    assert told["held_velocity"].remedy.option == "--derive dq1"


def test_positions_of_few_digits_are_not_held(signals, torque, found):
    told = {s.check for s in found(signals.with_(q=np.round(signals.q, 1)), torque)}
    assert "held_position" not in told


def test_torques_that_are_lost_in_parts_of_a_recording(signals, torque, found, only):
    held = torque.copy()
    for start in range(150, 1900, 170):
        held[start : start + 25] = held[start - 1]
    told = found(signals, held)
    only(told, "held_torque", "certain", "--drop-repeated")
    assert "11 parts of about 25 rows" in told[0].evidence


def test_torques_that_keep_values_one_by_one_are_not_lost(signals, torque, found):
    kept = torque.copy()
    for start in range(150, 1900, 170):
        kept[start : start + 25, 0] = kept[start, 0]
        kept[start + 10 : start + 35, 1] = kept[start + 10, 1]
    told = {s.check for s in found(signals, kept)}
    assert not told & {"held_torque", "clipped_torque"}
