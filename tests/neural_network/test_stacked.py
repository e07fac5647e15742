# SPDX-License-Identifier: BSD-3-Clause
"""Members of an ensemble trained as one computation are what they are alone.

A callback that does nothing keeps members from being trained together.
"""

import numpy as np
import pytest
from sklearn.base import clone
from skorch.callbacks import Callback

from skidyn.neural_network import BLLRegressor, LSTMRegressor, NDLRegressor

SMALL = {"window": 6, "hidden_size": 4, "max_epochs": 2}
MEMBERS = {
    "plain": LSTMRegressor(**SMALL),
    "dense": NDLRegressor(**SMALL, dense_size=5, dropout=0.0),
    "per joint": LSTMRegressor(**SMALL, per_joint=True),
}


@pytest.mark.parametrize("name", MEMBERS)
@pytest.mark.parametrize("resample", ["trajectory", "window"])
def test_weights_and_predictions_are_those_of_each_alone(name, resample, log):
    """Bootstraps keep another number of rows for each member."""
    X, y = log
    bll = BLLRegressor(MEMBERS[name], n_estimators=3, resample=resample, random_state=0)
    together = bll.fit(X, y).bagging_.estimators_
    single = clone(bll).set_params(estimator__callbacks=[Callback()]).fit(X, y)
    signals = X.to_numpy()
    for one, other in zip(together, single.bagging_.estimators_, strict=True):
        for own, alone in zip(one.weights_, other.weights_, strict=True):
            assert set(own) == set(alone)
            for key, weights in own.items():
                np.testing.assert_allclose(weights, alone[key], rtol=1e-5, atol=1e-5)
        np.testing.assert_allclose(one.predict(signals), other.predict(signals), atol=1e-5)
    first, second = (member.weights_[0]["output.weight"] for member in together[:2])
    assert np.abs(first - second).max() > 1e-2
