# SPDX-License-Identifier: BSD-3-Clause
"""A push that nothing logged predicts."""


def test_a_push_is_found_with_its_recording_and_time(pushed):
    X, _ = pushed.data
    episodes = [e for finding in pushed.findings for e in finding.when]
    assert [(e.trajectory, e.joints) for e in episodes] == [(3, (2,))]
    start = X["time"][X["trajectory"] == 3].iloc[0]
    assert abs(episodes[0].start - start - 4.0) < 0.3 and abs(episodes[0].end - start - 4.6) < 0.3
    assert pushed.verdict == "unknown"
