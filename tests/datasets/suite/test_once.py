# SPDX-License-Identifier: BSD-3-Clause
"""An effect in one recording of a log."""

import pytest


@pytest.mark.slow
def test_it_acts_in_one_recording_that_the_truth_names(once):
    (effect,) = once.truth["effects"]
    assert effect["kind"] == "spring" and once.truth["detectable"]
    (number,) = effect["trajectories"]
    assert number in set(once.frame["trajectory"])
