# SPDX-License-Identifier: BSD-3-Clause
"""Motions of the suite."""

from skidyn.datasets import load_planar_arm


def test_every_recording_moves_both_joints_within_their_limits(empty):
    frame, robot = empty.frame, load_planar_arm()
    for joint in (1, 2):
        low, high = robot.position_limits[joint - 1]
        assert frame[f"q{joint}"].between(low, high).all()
        assert frame[f"dq{joint}"].abs().max() < robot.velocity_limits[joint - 1]
    assert frame["trajectory"].nunique() == 6
    for _, run in frame.groupby("trajectory"):
        assert (run[["dq1", "dq2"]].abs().max() > 0.3).all()
        assert (run[["q1", "q2"]].max() - run[["q1", "q2"]].min() > 0.25).all()
    assert all(0.1 < share < 0.5 for share in empty.truth["rest_share"])  # from point to point
