# SPDX-License-Identifier: BSD-3-Clause
"""What a search adds fades out beyond the motion to which it was fitted."""

import pickle

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer

import skidyn
from skidyn.diagnosis import EffectSearchCV
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

pytestmark = pytest.mark.usefixtures("diagnosed_once")
PENDULUM = Robot.from_urdf(
    '<robot name="pendulum"><link name="base"/><link name="rod"><inertial>'
    '<origin xyz="0.2 0 0"/><mass value="1.5"/>'
    '<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    '<joint name="j1" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>'
    '<limit lower="-3" upper="3" effort="50" velocity="3"/></joint></robot>'
)


def swings(amplitudes, seed):
    """Trajectory, time, q, dq, ddq of swings; torque with a cable that gives way."""
    t, parts = np.arange(300) * 0.02, []
    for k, a in enumerate(amplitudes):
        w = 2.0 + 0.3 * k
        motion = np.sin(w * t), w * np.cos(w * t), -(w**2) * np.sin(w * t)
        parts.append(np.c_[np.full(300, k), t, a * np.transpose(motion)])
    X = np.concatenate(parts)
    torque = PENDULUM.inverse_dynamics(X[:, [2]], X[:, [3]], X[:, [4]])[:, 0]
    noise = 0.02 * np.random.default_rng(seed).normal(size=len(X))
    return X, torque + 0.5 * np.sign(X[:, 3]) + 0.6 * np.tanh(4 * X[:, 2]) + noise


X, Y = swings([0.35, 0.45, 0.5, 0.6, 0.65, 0.7], 0)
WIDE, WIDE_TORQUE = swings([3.0], 1)
MODEL = RBDRegressor(PENDULUM, trajectory=0, time=1)
SEARCH = EffectSearchCV(MODEL, effects=("nonlinear_spring",), cv=3)  # grows without bound


def error(model):
    return np.sqrt(np.mean((model.predict(WIDE) - WIDE_TORQUE) ** 2))


@pytest.fixture(scope="module")
def search(diagnosed_once):
    return clone(SEARCH).fit(X, Y)


def test_the_prediction_falls_back_on_the_start_where_the_log_did_not_go(search):
    assert search.best_effects_
    np.testing.assert_allclose(search.predict(X), search.best_estimator_.predict(X), rtol=1e-9)
    start = clone(MODEL).fit(X, Y)
    assert error(search) < error(start) < 0.8 * error(search.best_estimator_)


def test_alone_without_fading(search):
    alone = clone(SEARCH).set_params(fade_out=False).fit(X, Y)
    assert alone.best_effects_ == search.best_effects_
    np.testing.assert_array_equal(alone.predict(WIDE), alone.best_estimator_.predict(WIDE))
    np.testing.assert_allclose(alone.predict(WIDE), search.best_estimator_.predict(WIDE))


def test_scores_are_those_of_the_prediction():
    both = np.r_[X, np.c_[WIDE[:, :1] + 9, WIDE[:, 1:]]]
    folds = [(np.arange(len(X)), np.arange(len(X), len(both)))]
    faded, alone = (
        clone(SEARCH)
        .set_params(cv=folds, fade_out=fade_out)
        .fit(both, np.r_[Y, WIDE_TORQUE])
        .cv_results_["split0_test_score"]
        for fade_out in (True, False)
    )
    assert faded[0] == alone[0]
    assert faded[1] > alone[0] + 0.01 > alone[1] + 0.02


def test_in_pipelines_files_and_copies(search, tmp_path):
    piped = clone(SEARCH).set_params(estimator=make_pipeline(FunctionTransformer(), clone(MODEL)))
    np.testing.assert_allclose(piped.fit(X, Y).predict(WIDE), search.predict(WIDE), rtol=1e-6)
    stored = skidyn.load_model(skidyn.save_model(tmp_path / "m.skops", search))
    for copy in (stored, pickle.loads(pickle.dumps(search))):
        np.testing.assert_array_equal(copy.predict(WIDE), search.predict(WIDE))
