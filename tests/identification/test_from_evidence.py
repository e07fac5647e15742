# SPDX-License-Identifier: BSD-3-Clause
"""A regressor from evidence alone."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.evidence import evidence_from_parquet
from skidyn.identification import RBDRegressor, regressor_from_evidence

ROBOT = load_planar_arm()
LOG = make_hidden_effect_log(ROBOT, None, n_trajectories=8, duration=4.0, random_state=3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Four files of two trajectories, in row groups that cut through them."""
    folder = tmp_path_factory.mktemp("parquet")
    for k in range(4):
        part = LOG.frame[(LOG.frame["trajectory"] - 1) // 2 == k]
        part.to_parquet(folder / f"part{k}.parquet", row_group_size=150)
    return folder


def test_regressor_predicts_like_one_fitted_in_memory(folder):
    effects = ("viscous", "coulomb")
    streamed = regressor_from_evidence(ROBOT, evidence_from_parquet(folder, ROBOT, effects))
    fitted = RBDRegressor(ROBOT, effects, smooth=True).fit(LOG.X, LOG.y)
    np.testing.assert_allclose(
        streamed.predict(LOG.X[list(streamed.feature_names_in_)]), fitted.predict(LOG.X), atol=2e-3
    )
    assert np.all(streamed.coef_std_ > 0)
