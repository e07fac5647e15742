# SPDX-License-Identifier: BSD-3-Clause
"""What is learned fades out away from the training samples."""

import numpy as np
from sklearn.ensemble import ExtraTreesRegressor
from sklearn.linear_model import LinearRegression

from skidyn.hybrid import HybridRegressor

FEATURES = ["q1", "q2", "dq1", "dq2"]  # what learners without key columns see
TREES = ExtraTreesRegressor(15, min_samples_leaf=5, random_state=0)


def test_fades_out_of_range_and_says_so(make_log):
    X, y = make_log()
    hybrid = HybridRegressor(LinearRegression(), TREES).fit(X, y)
    assert hybrid.outside_range(X).mean() < 0.05
    far = X.copy()
    far[["q1", "q2"]] += 10.0
    assert hybrid.outside_range(far).all()
    np.testing.assert_array_equal(hybrid.predict(far), hybrid.physics_.predict(far[FEATURES]))
