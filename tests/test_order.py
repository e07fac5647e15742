# SPDX-License-Identifier: BSD-3-Clause
"""Rows that were shuffled are told from recordings that begin again."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import LogError
from skidyn.identification import RBDRegressor
from skidyn.preprocessing import TimeDerivative

LOG = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=4, duration=2.0)


def test_shuffled_rows_are_sorted_by_recording_and_time():
    mixed = np.random.default_rng(0).permutation(len(LOG.X))
    X, y = LOG.X.iloc[mixed].reset_index(drop=True), LOG.y[mixed]
    model, other = RBDRegressor(LOG.robot).fit(LOG.X, LOG.y), RBDRegressor(LOG.robot).fit(X, y)
    np.testing.assert_allclose(other.coef_, model.coef_, rtol=1e-9)
    np.testing.assert_allclose(other.predict(X), model.predict(LOG.X)[mixed], rtol=1e-9)
    with pytest.raises(LogError, match="not in the order of time"):
        TimeDerivative().fit_transform(X[["time", "trajectory", "q1"]])


def test_recordings_one_after_the_other_are_in_order():
    again = LOG.X.assign(time=LOG.X["time"] - LOG.X.groupby("trajectory")["time"].transform("min"))
    for table in (LOG.X, again):
        TimeDerivative().fit_transform(table[["time", "trajectory", "q1"]])
