# SPDX-License-Identifier: BSD-3-Clause
"""Where a model fails."""


def test_joints_are_told_by_error_over_noise(diagnosis_page):
    shown = diagnosis_page["where"]
    assert "shoulder (joint 1): error 3.0 N m, 15 times its noise of 0.20 N m" in shown
    assert "slider (3) – 0.37 0.36" in shown  # it never rests
