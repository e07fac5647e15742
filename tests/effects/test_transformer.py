# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pandas as pd
import pytest
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.utils.estimator_checks import parametrize_with_checks

from skidyn.effects import FrictionTransformer, Term
from skidyn.exceptions import ColumnError, EffectError


@parametrize_with_checks([FrictionTransformer()])
def test_scikit_learn_contract(estimator, check):
    check(estimator)


@pytest.fixture
def frame():
    rng = np.random.default_rng(0)
    names = ["trajectory", "time", "dq2", "dq1", "q1", "q2", "ddq1", "ddq2"]
    X = pd.DataFrame(rng.uniform(-1, 1, (200, 8)), columns=names)
    X["trajectory"], X["time"] = np.repeat([3, 4], 100), np.tile(np.arange(100) * 0.01, 2)
    return X


def test_recovers_friction(frame):
    y = 0.7 * frame[["dq1", "dq2"]].to_numpy()
    y += 0.4 * np.tanh(frame[["dq1", "dq2"]].to_numpy() / 0.003)
    transformer = FrictionTransformer().set_output(transform="pandas")
    features = transformer.fit_transform(frame)
    pd.testing.assert_frame_equal(features[frame.columns], frame.astype(float))
    pipe = make_pipeline(FrictionTransformer(), LinearRegression()).fit(frame, y)
    assert pipe.score(frame, y) == pytest.approx(1.0)
    own = features.drop(columns=frame.columns)
    assert list(own) == ["viscous_Fv_1", "viscous_Fv_2", "coulomb_Fc_1", "coulomb_Fc_2"]
    for j in (1, 2):
        joint = own[[f"viscous_Fv_{j}", f"coulomb_Fc_{j}"]]
        np.testing.assert_allclose(LinearRegression().fit(joint, y[:, j - 1]).coef_, [0.7, 0.4])


def test_hysteresis_starts_anew_with_each_trajectory(frame):
    transformer = FrictionTransformer([Term("dahl", (1,), {"presliding": 0.5})]).fit(frame)
    state = transformer.transform(frame)[:, -1]
    assert state[0] == state[100] == 0
    np.testing.assert_allclose(transformer.transform(frame[100:])[:, -1], state[100:])


@pytest.mark.parametrize(
    ("effect", "error", "words"),
    [
        ("load_dependent_friction", EffectError, "load"),
        ("payload", EffectError, "RBDRegressor"),
        (("coupled_friction", [1, 2]), EffectError, "one joint"),
        ("stribeck", EffectError, "shape parameters"),
        ("temperature_offset", ColumnError, "temperature"),
    ],
)
def test_refuses_what_the_motion_does_not_tell(frame, effect, error, words):
    with pytest.raises(error, match=words):
        FrictionTransformer([effect]).fit(frame)


def test_number_of_joints():
    with pytest.raises(ColumnError, match="n_joints=2"):
        FrictionTransformer(n_joints=2).fit(np.zeros((5, 3)))
    with pytest.warns(UserWarning, match="7 columns"):
        FrictionTransformer().fit(np.zeros((5, 7)))
