# SPDX-License-Identifier: BSD-3-Clause
"""Both recordings over time."""

from skidyn.report import summarize_comparison


def test_two_recordings_begin_at_their_own_start(comparison_page):
    assert "Two recordings, each from its beginning" in comparison_page["time"]


def test_two_models_of_one_recording_share_the_measured_torque(fakes):
    both = fakes.make_diagnosis(), fakes.make_diagnosis()
    summary = summarize_comparison(*both)
    assert summary["report"]["same_log"]
    assert len(summary["time"]["joints"][0]) == 1
