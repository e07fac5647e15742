# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pandas as pd
import polars as pl
import pytest
from sklearn.utils.estimator_checks import (
    check_dataframe_column_names_consistency,
    check_set_output_transform_pandas,
    parametrize_with_checks,
)

from skidyn.exceptions import ColumnError
from skidyn.preprocessing import (
    ButterworthFilter,
    CurrentToTorque,
    DropKeys,
    SignalScaler,
    SmoothDerivatives,
    TimeDerivative,
)

SEQUENCE = {
    "check_methods_sample_order_invariance": "the order of rows is time, so it matters",
    "check_methods_subset_invariance": "a sample is smoothed or differentiated with its neighbours",
}
ESTIMATORS = [
    ButterworthFilter(0.1, rate=1.0),
    TimeDerivative(rate=1.0),
    SmoothDerivatives(rate=1.0, cutoff=0.1),
    SignalScaler(),
    DropKeys(),
    CurrentToTorque(101, 0.125),
]


@parametrize_with_checks(
    ESTIMATORS,
    expected_failed_checks=lambda e: (
        SEQUENCE if isinstance(e, ButterworthFilter | SmoothDerivatives | TimeDerivative) else {}
    ),
)
def test_scikit_learn_contract(estimator, check):
    check(estimator)


@pytest.mark.parametrize("estimator", ESTIMATORS, ids=lambda e: type(e).__name__)
def test_names_and_set_output(estimator):
    name = type(estimator).__name__
    check_dataframe_column_names_consistency(name, estimator)
    check_set_output_transform_pandas(name, estimator)


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


def test_current_becomes_torque_and_back():
    current = np.array([[1.0, -2.0]])
    model = CurrentToTorque([101, 50], 0.1)
    torque = model.fit_transform(current)
    np.testing.assert_allclose(torque, [[10.1, -10.0]])
    np.testing.assert_allclose(model.inverse_transform(torque), current)
    with pytest.raises(ValueError, match="give 3 gains for 2 joints"):
        CurrentToTorque([1, 2, 3]).fit(current)


def test_messages(log):
    with pytest.raises(ValueError, match="not below half the sampling rate"):
        ButterworthFilter(50.0).fit_transform(log)
    with pytest.raises(ValueError, match="give rate in Hz"):
        ButterworthFilter().fit(log[["q1"]])
    with pytest.raises(ValueError, match="time does not advance at row 3"):
        repeated = log.copy()
        repeated.loc[3, "time"] = repeated.loc[2, "time"]
        TimeDerivative().fit_transform(repeated)
