# SPDX-License-Identifier: BSD-3-Clause
"""Positions that were wrapped."""

import numpy as np
import pytest

from skidyn.logs import read_log


def test_wrapped_position(signals, torque, found):
    far = signals.with_(q=signals.q + [np.pi, 0])
    wrapped = far.with_(q=(far.q + np.pi) % (2 * np.pi) - np.pi)
    told = found(wrapped, torque)
    assert "--unwrap" in {s.remedy.option for s in told if s.check == "wrapped_position"}


@pytest.mark.parametrize("counter", [6.5536, 2.6])
def test_a_counter_that_overflows_at_no_full_turn(counter, recorded, told_of, tmp_path, arm):
    frame = recorded.frame
    far = frame["q1"] + counter / 2 - frame["q1"].median()
    wrapped = frame.assign(q1=(far + counter / 2) % counter - counter / 2)
    told = told_of(wrapped)["wrapped_position"]
    assert f"it jumps by {counter:g} rad" in told.evidence and told.certainty == "certain"
    wrapped.to_csv(tmp_path / "log.csv", index=False)
    with pytest.warns(UserWarning, match="range of a counter"):
        mended = read_log(tmp_path / "log.csv", robot=arm, unwrap=True, check=False)
    turns = (mended["q1"] - far) / counter
    assert np.ptp(turns) < 1e-4  # all joined again


def test_the_velocity_of_a_wrapped_position_is_its_derivative(recorded, told_of):
    far = recorded.frame["q1"] + 3.2768 - recorded.frame["q1"].median()
    told = told_of(recorded.frame.assign(q1=(far + 3.2768) % 6.5536 - 3.2768))
    assert "velocity" not in told and "odd_motion" not in told and "joined_recordings" not in told
