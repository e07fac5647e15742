# SPDX-License-Identifier: BSD-3-Clause
"""Velocities against the positions."""

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


def test_a_filtered_velocity_has_no_other_unit(signals, torque, found):
    from scipy.signal import lfilter

    share = 0.01 / (0.25 + 0.01)
    slow = lfilter([share], [1, share - 1], signals.dq, axis=0)
    told = [s.check for s in found(signals.with_(dq=slow), torque) if s.certainty == "certain"]
    assert "clock_unit" not in told
