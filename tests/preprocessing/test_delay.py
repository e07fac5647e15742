# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pandas as pd
import pytest

from skidyn.preprocessing import advance_channels, estimate_delay


def wave(t):
    return np.sin(4 * t) + 0.4 * np.sin(13 * t + 1)


@pytest.fixture
def log():
    rng = np.random.default_rng(0)
    parts = []
    for k in range(3):
        t = np.arange(1500) * 0.004
        noisy = -3 * wave(t + k - 0.0215) + 7 + 0.01 * rng.normal(size=t.size)
        parts.append(
            pd.DataFrame({"time": t, "trajectory": k, "q1": wave(t + k), "tau1": noisy, "tau2": t})
        )
    return pd.concat(parts, ignore_index=True)


def test_delay_scale_and_offset_do_not_matter(log):
    found = estimate_delay(
        log["q1"], log["tau1"], time=log["time"], trajectory=log["trajectory"], largest=0.05
    )
    assert found.delay == pytest.approx(0.0215, abs=max(5e-4, 3 * found.standard_error))
    assert found.correlation < -0.9
    back = estimate_delay(log["tau1"][:1500], log["q1"][:1500], rate=250.0, largest=0.05)
    assert back.delay == pytest.approx(-0.0215, abs=1e-3)


def test_delay_is_taken_out(log):
    mended = advance_channels(log, {"tau1": 0.0215})
    assert len(log) - len(mended) == 3 * 6  # 21.5 ms are six samples at the end of each
    assert mended["tau2"].equals(
        log.loc[log["time"] <= 5.996 - 0.0215, "tau2"].reset_index(drop=True)
    )
    rest = estimate_delay(
        mended["q1"], mended["tau1"], time=mended["time"], trajectory=mended["trajectory"]
    )
    assert abs(rest.delay) < 5e-4
    assert len(advance_channels(log, {"tau": -0.01})) == len(log) - 3 * 3


def test_delay_that_grows_is_counted_from_the_beginning_of_every_trajectory(log):
    mended = advance_channels(log, {"q1": (0.0, 0.01)})
    for run, rows in mended.groupby("trajectory"):
        own = log[log["trajectory"] == run]
        since = rows["time"] - own["time"].iloc[0]
        expected = np.interp(rows["time"] + 0.01 * since, own["time"], own["q1"])
        np.testing.assert_allclose(rows["q1"], expected, atol=1e-3 * own["q1"].abs().max())


def test_messages(log):
    with pytest.raises(ValueError, match="constant signal"):
        estimate_delay(log["q1"], 0 * log["q1"], rate=250.0)
    with pytest.raises(ValueError, match="at the edge"):
        estimate_delay(log["q1"][:1500], log["tau1"][:1500], rate=250.0, largest=0.01)
    with pytest.raises(ValueError, match="give time"):
        estimate_delay(log["q1"], log["tau1"])
    with pytest.raises(ValueError, match="long enough"):
        estimate_delay(log["q1"][:50], log["tau1"][:50], rate=250.0)
    with pytest.raises(ValueError, match="has no i1"):
        advance_channels(log, {"i1": 0.1})


@pytest.mark.parametrize(
    ("delay", "told"), [(np.nan, "finite number of s"), (100.0, "no recording is longer")]
)
def test_an_impossible_delay_is_refused(log, delay, told):
    with pytest.raises(ValueError, match=told):
        advance_channels(log, {"tau1": delay})
