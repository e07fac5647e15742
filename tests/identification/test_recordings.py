# SPDX-License-Identifier: BSD-3-Clause
"""Recordings are recognised by their motion."""

import numpy as np
import pytest
from sklearn.experimental import enable_halving_search_cv  # noqa: F401

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import Term
from skidyn.exceptions import ColumnError
from skidyn.identification import RBDRegressor
from skidyn.model_selection import LeakageWarning

ROBOT = load_planar_arm()
LOG = make_hidden_effect_log(ROBOT, None, n_trajectories=8, duration=4.0, random_state=2)
N = ROBOT.n_joints


def with_acceleration(X):
    motion = RBDRegressor(ROBOT).fit(LOG.X, LOG.y)._motion(X)[0]
    return X.assign(**{f"ddq{j + 1}": motion.ddq[:, j] for j in range(N)})


FULL = with_acceleration(LOG.X)


def rmse(model, X, y):
    return float(np.sqrt(np.mean((model.predict(X) - y) ** 2)))


def test_recordings_on_top_of_each_other():
    """Without their number nothing tells rows of recordings with the same clock apart."""
    start = FULL.groupby("trajectory")["time"].transform("min")
    same = FULL.assign(time=(FULL["time"] - start).round(6)).drop(columns="trajectory")
    mixed = np.random.default_rng(0).permutation(len(FULL))
    X, y = same.iloc[mixed], LOG.y[mixed]
    with pytest.warns(LeakageWarning):
        model = RBDRegressor(ROBOT, smooth=False).fit(X, y)
    assert rmse(model, same, LOG.y) < 0.5 * LOG.y.std()
    bare = X.drop(columns=["ddq1", "ddq2"])
    with pytest.warns(LeakageWarning), pytest.raises(ColumnError, match="number the recordings"):
        RBDRegressor(ROBOT).fit(bare, y)


@pytest.fixture(scope="module")
def with_an_offset_in_one_run():
    y = LOG.y + 2.0 * (LOG.X["trajectory"].to_numpy() == 1)[:, None] * np.array([1.0, 0.0])
    terms = ["viscous", "coulomb", Term("offset", (1,), {"trajectories": (1,)})]
    return RBDRegressor(ROBOT, terms).fit(LOG.X, y), y


def test_what_is_found_in_one_recording_stays_with_it(with_an_offset_in_one_run):
    model, y = with_an_offset_in_one_run
    assert rmse(model, LOG.X, y) < 1.05 * rmse(RBDRegressor(ROBOT).fit(LOG.X, LOG.y), LOG.X, LOG.y)
    other = make_hidden_effect_log(ROBOT, None, n_trajectories=3, duration=4.0, random_state=7)
    plain = RBDRegressor(ROBOT).fit(LOG.X, LOG.y)
    assert rmse(model, other.X, other.y) < 1.05 * rmse(plain, other.X, other.y)


def test_a_recording_is_known_again_by_its_motion(with_an_offset_in_one_run):
    model, y = with_an_offset_in_one_run
    one = LOG.X[LOG.X["trajectory"] == 1]
    expected = model.predict(LOG.X)[(LOG.X["trajectory"] == 1).to_numpy()]
    np.testing.assert_allclose(model.predict(one.assign(trajectory=9)), expected, atol=1e-9)
    part = one.iloc[100:300].astype("float32")
    assert np.abs(model.predict(part)[30:-30] - expected[130:270]).max() < 0.3
