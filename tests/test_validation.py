# SPDX-License-Identifier: BSD-3-Clause
"""A log with torque may be given as X, and one without to predict."""

import numpy as np
import pandas as pd
import polars as pl
import pytest
from sklearn.linear_model import Ridge
from sklearn.pipeline import make_pipeline

from skidyn._validation import motion_of
from skidyn.committee import ELMCommittee
from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import FrictionTransformer
from skidyn.hybrid import HybridRegressor, OwnJointRegressor
from skidyn.identification import RBDRegressor
from skidyn.neural_network import BLLRegressor, LSTMRegressor, SDLRegressor

ROBOT = load_planar_arm()
LOG = make_hidden_effect_log(ROBOT, None, n_trajectories=2, duration=1.0, random_state=0)
TORQUE = ["tau1", "tau2"]
NETWORK = {"max_epochs": 1, "random_state": 0}


@pytest.fixture(scope="module")
def table():
    frame = LOG.frame.copy()
    for k in "12":
        frame[f"ddq{k}"] = np.gradient(frame[f"dq{k}"], 0.01)
    return frame


@pytest.mark.parametrize(
    "estimator",
    [
        RBDRegressor(ROBOT),
        ELMCommittee(n_estimators=2, random_state=0),
        OwnJointRegressor(Ridge()),
        HybridRegressor(RBDRegressor(ROBOT), Ridge(), cv=2),
        LSTMRegressor(**NETWORK),
        BLLRegressor(LSTMRegressor(**NETWORK), n_estimators=2, random_state=0),
        SDLRegressor(ROBOT, cv=None, **NETWORK),
        make_pipeline(FrictionTransformer(), Ridge()),
    ],
    ids=lambda estimator: type(estimator).__name__,
)
@pytest.mark.filterwarnings("ignore")
def test_a_log_without_torque_is_predicted_by_a_model_fitted_to_one_with(estimator, table):
    new = table.drop(columns=TORQUE)
    model = estimator.fit(table, table[TORQUE])
    assert not {*TORQUE} & {*model.feature_names_in_}
    np.testing.assert_array_equal(model.predict(new), model.predict(table))
    with pytest.raises(ValueError, match="feature names"):
        model.predict(new.drop(columns="dq2"))


@pytest.mark.parametrize("make", [pd.DataFrame, pl.DataFrame])
def test_only_columns_of_torque_are_left_out(make):
    log = make({"tau1": [0.0], "q1": [0.0], "tau_filtered": [0.0], "dq1": [0.0]})
    assert list(motion_of(RBDRegressor(ROBOT), log).columns) == ["q1", "tau_filtered", "dq1"]
    with pytest.raises(ValueError, match="Give the name of the column, such as trajectory='q1'"):
        motion_of(RBDRegressor(ROBOT, trajectory=1), log)
    named = make({"tau_elbow": [0.0], "q_elbow": [0.0], "tau_filtered": [0.0]})
    assert list(motion_of(RBDRegressor(ROBOT), named).columns) == ["q_elbow", "tau_filtered"]
    other = make({"tau1": [0.0], "past": [0.0]})
    assert motion_of(ELMCommittee(), other) is other
