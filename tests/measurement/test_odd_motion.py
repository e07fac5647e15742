# SPDX-License-Identifier: BSD-3-Clause
"""Single recordings whose clock, positions or velocities are not those of the others."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.logs import check_log

ROBOT = load_planar_arm()
FRAME = make_hidden_effect_log(
    ROBOT, "stribeck", joints=[2], n_trajectories=6, duration=8.0, random_state=3
).frame
RUN = int(FRAME["trajectory"].unique()[2])
OWN = FRAME["trajectory"] == RUN


def told_of(change):
    frame = FRAME.copy()
    for name, values in change.items():
        frame.loc[OWN, name] = values
    return [s for s in check_log(frame, ROBOT).checks if s.certainty != "noted"]


def test_recordings_that_are_alike():
    assert told_of({}) == []


def test_velocities_in_degrees_per_second():
    (told,) = told_of({name: np.rad2deg(FRAME.loc[OWN, name]) for name in ("dq1", "dq2")})
    assert told.check == "odd_motion" and told.certainty == "certain" and told.joints == ()
    assert f"in trajectory {RUN} clock, positions or velocities" in told.suspicion
    assert "velocities are 57." in told.evidence


@pytest.mark.parametrize("joint", [1, 2])
def test_the_sign_of_a_velocity(joint):
    (told,) = told_of({f"dq{joint}": -FRAME.loc[OWN, f"dq{joint}"]})
    assert told.joints == (joint,) and "the opposite sign" in told.suspicion


def test_the_velocity_of_another_joint():
    (told,) = told_of({"dq2": FRAME.loc[OWN, "dq1"]})
    assert told.joints == (2,) and "is not the derivative of its position" in told.suspicion


def test_a_clock_in_another_unit():
    clock = FRAME.loc[OWN, "time"].to_numpy()
    frame = FRAME.copy()
    frame.loc[OWN, "time"] = FRAME["time"].max() + 1 + 1e3 * (clock - clock[0])
    order = np.r_[np.flatnonzero(~OWN), np.flatnonzero(OWN)]
    told = check_log(frame.iloc[order].reset_index(drop=True), ROBOT).checks
    assert told[0].check == "odd_motion" and told[0].joints == ()


def test_what_differs_in_most_recordings_is_not_of_single_ones():
    frame = FRAME.copy()
    some = frame["trajectory"].isin(frame["trajectory"].unique()[:3])
    frame.loc[some, "dq2"] *= -1
    assert "odd_motion" not in {s.check for s in check_log(frame, ROBOT).checks}


def test_a_slow_recording_whose_velocity_is_cut_to_few_digits():
    """Nearly all of its velocities are zero, but those of the others are right."""
    frame = FRAME.copy()
    frame.loc[OWN, ["q2", "dq2"]] *= 0.4
    step = 0.395 * frame.loc[~OWN, "dq2"].abs().max()
    step = min(step, 0.99 * frame.loc[OWN, "dq2"].abs().max())
    frame["dq2"] = np.trunc(frame["dq2"] / step) * step
    assert "odd_motion" not in {s.check for s in check_log(frame, ROBOT).checks}


def test_recordings_that_were_stretched_to_one_duration():
    frame = FRAME.copy()
    for run, factor in zip(
        frame["trajectory"].unique(), (1.4, 0.8, 1.1, 0.9, 1.25, 1.0), strict=False
    ):
        own = frame["trajectory"] == run
        start = frame.loc[own, "time"].min()
        frame.loc[own, "time"] = start + factor * (frame.loc[own, "time"] - start)
    (told,) = [s for s in check_log(frame, ROBOT).checks if s.certainty != "noted"]
    assert (told.check, told.certainty) == ("odd_motion", "certain")
    assert told.suspicion == "the clock has another rate in every trajectory"
    assert "1.4 in" in told.evidence
