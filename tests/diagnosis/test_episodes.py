# SPDX-License-Identifier: BSD-3-Clause
"""A push that nothing logged predicts."""

import numpy as np
import pytest

from skidyn.diagnosis import diagnose


@pytest.mark.filterwarnings("ignore::skidyn.exceptions.LogWarning")
def test_a_push_is_found_with_its_recording_and_time(complete):
    X, y = complete.data
    y = np.array(y)
    run = (X["trajectory"] == 3).to_numpy()
    time = X["time"].to_numpy() - X["time"][run].iloc[0]
    y[run & (time > 4.0) & (time < 4.6), 1] += 3.0

    pushed = diagnose(complete.base_model, X, y, effects=[])

    episodes = [e for finding in pushed.findings for e in finding.when]
    assert [(e.trajectory, e.joints) for e in episodes] == [(3, (2,))]
    start = X["time"][run].iloc[0]
    assert abs(episodes[0].start - start - 4.0) < 0.3 and abs(episodes[0].end - start - 4.6) < 0.3
    assert pushed.verdict == "unknown"
