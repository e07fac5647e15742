# SPDX-License-Identifier: BSD-3-Clause
"""Velocities against the positions, and recordings that were joined."""

import numpy as np
import pytest


def test_velocity_with_the_other_sign(signals, torque, found, only):
    turned = signals.with_(dq=signals.dq * [1, -1])
    only(found(turned, torque), "velocity", "certain", "--flip dq2")


def test_exchanged_velocities(signals, torque, found, only):
    only(
        found(signals.with_(dq=signals.dq[:, ::-1]), torque),
        *("velocity", "certain", "--order dq=2,1"),
    )


def test_late_velocities(signals, torque, found, only):
    late = np.stack([np.interp(signals.time - 0.03, signals.time, dq) for dq in signals.dq.T], 1)
    only(found(signals.with_(dq=late), torque), "velocity_delay", "suspected", "--late dq=0.03")


def test_commanded_velocities_are_early(recorded, told_of):
    """The torque is in time with the position, so that this one is not late."""
    frame = recorded.frame.copy()
    for rows in frame.groupby("trajectory").groups.values():
        time, values = frame.loc[rows, "time"], frame.loc[rows, ["dq1", "dq2"]].to_numpy()
        early = [np.interp(time + 0.05, time, own) for own in values.T]
        frame.loc[rows, ["dq1", "dq2"]] = np.stack(early, axis=1)
    told = told_of(frame)["velocity_delay"]
    assert told.remedy.option == "--derive dq" and "the torque is not" in told.suspicion


def test_the_commanded_velocity_of_one_joint(recorded, told_of):
    frame = recorded.frame.copy()
    for rows in frame.groupby("trajectory").groups.values():
        time, values = frame.loc[rows, "time"], frame.loc[rows, "dq2"]
        frame.loc[rows, "dq2"] = np.interp(time + 0.05, time, values)
    told = told_of(frame)["velocity_delay"]
    assert told.joints == (2,) and told.remedy.option == "--derive dq2"


def test_joined_recordings_are_told_once_and_cut_for_other_checks(signals, torque, found, only):
    kept = np.r_[0:700, 1250:2000]
    joined = signals.take(kept).with_(time=signals.time[: len(kept)])
    only(found(joined, torque[kept]), "joined", "certain", "--split-leaps")


@pytest.mark.parametrize("column", ["q2", "dq2"])
def test_a_position_or_velocity_that_never_changes(column, recorded, told_of):
    told = told_of(recorded.frame.assign(**{column: 0.3}))["velocity"]
    assert told.certainty == "certain" and told.joints == (2,) and "constant" in told.suspicion


def test_rows_that_run_backwards(signals, torque, found):
    backwards = signals.with_(q=signals.q[::-1], dq=signals.dq[::-1])
    told = found(backwards, torque[::-1])
    assert told[0].suspicion == "rows run backwards in time" and told[0].certainty == "certain"
    flipped = found(signals.with_(dq=-signals.dq), torque)
    assert flipped[0].remedy.option == "--flip dq1,dq2"


def test_the_velocity_of_one_joint_is_late(recorded, told_of):
    frame = recorded.frame.copy()
    for rows in frame.groupby("trajectory").groups.values():
        time, values = frame.loc[rows, "time"], frame.loc[rows, "dq2"]
        frame.loc[rows, "dq2"] = np.interp(time - 0.03, time, values)
    told = told_of(frame)["velocity_delay"]
    name, _, lag = told.remedy.option.partition("=")
    assert told.joints == (2,) and name == "--late dq2"
    assert float(lag) == pytest.approx(0.03, abs=0.004)


def test_an_encoder_that_is_stuck_in_one_recording(recorded, told_of):
    frame = recorded.frame.copy()
    run = frame["trajectory"].unique()[1]
    frame.loc[frame["trajectory"] == run, "q2"] = 0.4
    told = told_of(frame)["velocity"]
    assert told.joints == (2,) and told.evidence.startswith(f"in {run};")


def test_velocities_in_degrees_beside_a_joint_at_rest(recorded, told_of):
    frame = recorded.frame.copy()
    noise = np.random.default_rng(3).normal(0.0, 0.03, len(frame))
    at_rest = frame["trajectory"] == frame["trajectory"].unique()[1]
    frame.loc[at_rest, "q2"], frame.loc[at_rest, "dq2"] = 0.4, noise[at_rest]
    frame[["dq1", "dq2"]] = np.rad2deg(frame[["dq1", "dq2"]])
    told = told_of(frame)
    assert all("does not change" not in s.suspicion for s in told.values())
    assert told["velocity"].remedy.option == "--units dq=deg/s", told


def test_an_encoder_that_loses_steps(signals, torque, found):
    q = signals.q.copy()
    for row in (500, 900, 1300):
        q[row:, 1] += 0.3
    told = {s.check: s for s in found(signals.with_(q=q), torque)}["joined"]
    assert told.joints == (2,) and "loses steps" in told.suspicion and told.remedy is None


def test_a_position_that_is_stuck_before_it_jumps(signals, torque, found):
    q = signals.q.copy()
    for row in (500, 1300):
        q[row : row + 60, 1] = q[row, 1]
    told = {s.check: s for s in found(signals.with_(q=q), torque)}["joined"]
    assert told.joints == (2,) and "stuck in parts" in told.suspicion


def test_a_filtered_velocity_has_no_other_unit(signals, torque, found):
    from scipy.signal import lfilter

    share = 0.01 / (0.25 + 0.01)
    slow = lfilter([share], [1, share - 1], signals.dq, axis=0)
    told = [s.check for s in found(signals.with_(dq=slow), torque) if s.certainty == "certain"]
    assert "clock_unit" not in told


@pytest.mark.parametrize("late", ["q", "dq"])
def test_a_channel_that_is_very_late(signals, torque, found, late):
    rows = np.maximum(np.arange(len(signals.q)) - 18, 0)
    told = found(signals.with_(**{late: getattr(signals, late)[rows]}), torque)
    told = {s.check: s for s in told if s.certainty != "noted"}
    assert set(told) == {"velocity_delay"}
    assert told["velocity_delay"].remedy.option == f"--late {late}=0.18"
