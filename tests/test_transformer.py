# SPDX-License-Identifier: BSD-3-Clause
"""Transformers of logs keep the contract of scikit-learn, names and outputs."""

import numpy as np
import pandas as pd
import pytest
from sklearn.utils.estimator_checks import (
    check_dataframe_column_names_consistency,
    check_set_output_transform_pandas,
    parametrize_with_checks,
)

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


def test_messages(log):
    with pytest.raises(ValueError, match="not below half the sampling rate"):
        ButterworthFilter(50.0).fit_transform(log)
    with pytest.raises(ValueError, match="give rate in Hz"):
        ButterworthFilter().fit(log[["q1"]])
    with pytest.raises(ValueError, match="time does not advance at row 3"):
        repeated = log.copy()
        repeated.loc[3, "time"] = repeated.loc[2, "time"]
        TimeDerivative().fit_transform(repeated)
