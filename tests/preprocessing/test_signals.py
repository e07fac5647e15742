# SPDX-License-Identifier: BSD-3-Clause
"""Filter, derivative and scaler of signals."""

import numpy as np
import pandas as pd
import polars as pl
import pytest

from skidyn.exceptions import ColumnError
from skidyn.preprocessing import ButterworthFilter, SignalScaler, TimeDerivative


@pytest.fixture
def log():
    t = np.arange(400) * 0.01
    frames = [
        pd.DataFrame({"trajectory": k, "time": t, "q1": np.sin(w * t), "dq1": w * np.cos(w * t)})
        for k, w in enumerate((2.0, 3.0))
    ]
    return pd.concat(frames, ignore_index=True)


def test_derivative_is_named_and_stays_within_trajectories(log):
    table = TimeDerivative().set_output(transform="pandas").fit_transform(log)
    assert list(table.columns) == [*log.columns, "ddq1"]
    speed = np.repeat([2.0, 3.0], 400)
    exact = -(speed**2) * log["q1"]
    assert np.abs(table["ddq1"] - exact).max() < 0.1
    inner = np.r_[1:399, 401:799]
    assert np.abs(table["ddq1"] - exact)[inner].max() < 5e-3
    array = TimeDerivative(trajectory=0, time=1).fit_transform(log.to_numpy())
    np.testing.assert_array_equal(array, table)
    own = TimeDerivative(["q1"]).fit(pl.from_pandas(log.drop(columns="dq1")))
    assert own.get_feature_names_out()[-1:].tolist() == ["dq1"]
    with pytest.raises(ColumnError, match="X has dq1 already"):
        TimeDerivative(["q1", "dq1"]).fit(pl.from_pandas(log))


def test_cutoff_tames_noise_and_keys_pass_untouched(log):
    noisy = log.assign(dq1=log["dq1"] + 0.01 * np.random.default_rng(0).normal(size=len(log)))
    exact = -(np.repeat([2.0, 3.0], 400) ** 2) * log["q1"]
    rough, smooth = (
        np.abs(TimeDerivative(cutoff=c).fit_transform(noisy)[:, -1] - exact).mean()
        for c in (None, 5)
    )
    assert smooth < 0.3 * rough
    filtered = ButterworthFilter(5.0).fit_transform(noisy)
    np.testing.assert_array_equal(filtered[:, :2], log[["trajectory", "time"]])
    first = noisy["trajectory"] == 0
    alone = ButterworthFilter(5.0, rate=100.0).fit_transform(noisy[first])
    np.testing.assert_allclose(filtered[first], alone, atol=1e-6)


def test_scaler_inverts(log):
    for kind in ("minmax", "standard"):
        scaler = SignalScaler(kind)
        scaled = scaler.fit_transform(log)
        np.testing.assert_array_equal(scaled[:, :2], log[["trajectory", "time"]])
        np.testing.assert_allclose(scaler.inverse_transform(scaled), log)


def test_cutoff_is_one_in_hz_at_every_rate():
    def wave(rate):
        time = np.arange(0, 20, 1 / rate)
        return pd.DataFrame({"time": time, "q1": np.sin(2 * np.pi * 8 * time)})

    fitted = ButterworthFilter(10.0).fit(wave(100.0))
    kept = {
        rate: np.ptp(fitted.transform(wave(rate))[len(wave(rate)) // 4 :, 1])
        for rate in (100, 1000)
    }
    assert kept[1000] == pytest.approx(kept[100], rel=0.05)
    with pytest.raises(ValueError, match="by the time column of X it is 100 Hz"):
        ButterworthFilter(10.0, rate=1000.0).fit(wave(100.0))
