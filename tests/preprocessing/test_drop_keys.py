# SPDX-License-Identifier: BSD-3-Clause
"""Key columns are kept from learners that do not know them."""

import numpy as np
import pandas as pd
from sklearn.linear_model import Ridge
from sklearn.pipeline import make_pipeline

from skidyn.preprocessing import DropKeys, SignalScaler

X = pd.DataFrame(
    {"trajectory": [1, 1, 2, 2], "time": [0.0, 0.1, 0.0, 0.1], "q1": [0.0, 1.0, 2.0, 3.0]}
)


def test_features_stay_with_their_names():
    dropped = DropKeys().set_output(transform="pandas").fit_transform(X)
    assert list(dropped) == ["q1"]
    np.testing.assert_array_equal(dropped["q1"], X["q1"])


def test_a_learner_behind_it_cannot_memorise_the_log():
    pipeline = make_pipeline(SignalScaler(), DropKeys(trajectory=0, time=1), Ridge(1e-9))
    pipeline.fit(X, 2 * X["q1"])
    renumbered = X.assign(trajectory=[9, 9, 9, 9], time=[5.0, 5.1, 5.2, 5.3])
    np.testing.assert_allclose(pipeline.predict(renumbered), 2 * X["q1"], atol=1e-6)


def test_torque_is_no_feature():
    table = pd.DataFrame(np.zeros((4, 4)), columns=["time", "q_elbow", "dq_elbow", "tau_elbow"])
    assert DropKeys().fit(table).get_feature_names_out().tolist() == ["q_elbow", "dq_elbow"]
