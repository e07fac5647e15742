# SPDX-License-Identifier: BSD-3-Clause
"""A log that arrives in pieces."""

import numpy as np
import pytest

from skidyn.neural_network import LSTMRegressor

SMALL = {"window": 8, "hidden_size": 12, "max_epochs": 15, "random_state": 0}


@pytest.mark.parametrize(("step", "stride"), [(1, 8), (5, 3), (8, 8), (37, 20)])
def test_stream_gives_the_numbers_of_the_whole_log(log, step, stride):
    X, y = log
    model = LSTMRegressor(**SMALL | {"max_epochs": 2, "stride": stride}).fit(X, y)
    X = X[:260]
    stream = model.stream()
    parts = [stream.predict(X[i : i + step]) for i in range(0, len(X), step)]
    np.testing.assert_allclose(np.concatenate(parts), model.predict(X), atol=1e-5)
    assert len(stream._past) <= model.window + 2 * model.stride
