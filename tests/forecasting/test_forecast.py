# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest
from sklearn.utils.estimator_checks import parametrize_with_checks

from skidyn.forecasting import AutoregressiveRegressor, PersistenceRegressor, forecast_table


class _AnyWidth:
    """For the common tests, whose tables hold no past: the last column is every output's past."""

    def _past(self, X):
        return np.repeat(X[:, -1:], getattr(self, "_n_outputs", 1), axis=1)

    def _check(self, X, y):
        y = np.asarray(y) if y is not None else y
        self._n_outputs = y.shape[1] if np.ndim(y) == 2 else 1
        return super()._check(X, y)

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.regressor_tags.poor_score = True
        return tags


class AnyPersistence(_AnyWidth, PersistenceRegressor): ...


class AnyAutoregressive(_AnyWidth, AutoregressiveRegressor): ...


SEQUENCE = {
    "check_methods_sample_order_invariance": "the order of rows is time, so it matters",
    "check_methods_subset_invariance": "a sample is forecast from several before it",
}


@parametrize_with_checks(
    [AnyPersistence(), AnyAutoregressive(3)],
    expected_failed_checks=lambda e: SEQUENCE if isinstance(e, AnyAutoregressive) else {},
)
def test_scikit_learn_contract(estimator, check):
    check(estimator)


def test_autoregression_finds_the_process_and_beats_persistence():
    rng = np.random.default_rng(0)
    signal = np.zeros((3000, 2))
    for t in range(2, 3000):
        signal[t] = [1.2, -0.5] * signal[t - 1] + [-0.5, 0.3] * signal[t - 2] + rng.normal(size=2)
    table = forecast_table(signal, np.repeat([0, 1], 1500))
    assert len(table.X) == 2998 and 1500 not in table.rows
    model = AutoregressiveRegressor(2, trajectory=0).fit(table.X, table.y)
    np.testing.assert_allclose(model.coef_, [[1.2, -0.5], [-0.5, 0.3]], atol=0.05)
    persistence = PersistenceRegressor(trajectory=0).fit(table.X, table.y)
    np.testing.assert_array_equal(persistence.predict(table.X), signal[table.rows - 1])
    assert model.score(table.X, table.y) > persistence.score(table.X, table.y)


def test_the_past_of_every_output_must_be_there():
    with pytest.raises(ValueError, match="the past of 2 signals and y has 1"):
        PersistenceRegressor().fit(np.zeros((5, 2)), np.zeros(5))


@pytest.mark.parametrize(
    ("signal", "keys", "told"),
    [
        ([], {}, "no samples"),
        ([1.0, np.nan, 2.0], {}, "not finite in row 1"),
        (np.arange(9.0), {"trajectory": [0, 0, 0]}, "one value for each of the 9 samples"),
        (np.arange(9.0), {"time": -np.arange(9.0)}, "not in the order of time"),
        (np.arange(8.0), {"trajectory": [0, 1] * 4}, "right before it"),
    ],
)
def test_rows_that_cannot_be_forecast_are_named(signal, keys, told):
    with pytest.raises(ValueError, match=told):
        forecast_table(signal, **keys)
