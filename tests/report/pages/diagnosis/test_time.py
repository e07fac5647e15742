# SPDX-License-Identifier: BSD-3-Clause
"""Errors of every trajectory."""


def test_errors_of_joints_and_trajectories(diagnosis_page):
    assert "shoulder (1) 0 3.007 3.001 N m 19%" in diagnosis_page["time"]
    assert "slider (3) 2 0.353 0.3016 N 8%" in diagnosis_page["time"]
