# SPDX-License-Identifier: BSD-3-Clause
"""Learners that read earlier rows say so of a shuffled log."""

import warnings

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.model_selection import LeakageWarning
from skidyn.neural_network import LSTMRegressor


def test_shuffled_rows_are_told_with_what_to_hold_out_and_ordered_ones_are_not():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=2.0)
    model = LSTMRegressor(window=2, hidden_size=2, max_epochs=1, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model.fit(log.X, log.y)
    order = np.random.default_rng(0).permutation(len(log.X))
    with pytest.warns(LeakageWarning, match="TrajectoryKFold, GroupKFold"):
        model.fit(log.X.iloc[order], log.y[order])
