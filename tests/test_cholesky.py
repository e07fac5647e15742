# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest
from scipy.linalg import cho_factor, cho_solve

from skidyn._cholesky import factored, solved


@pytest.mark.parametrize("shape", [(6,), (6, 3)])
def test_results_are_those_of_scipy_to_the_last_bit(shape):
    rng = np.random.default_rng(0)
    columns, right = rng.normal(size=(20, 6)), rng.normal(size=shape)
    gram = columns.T @ columns

    np.testing.assert_array_equal(solved(factored(gram), right), cho_solve(cho_factor(gram), right))


def test_a_model_without_coefficients_has_none():
    assert solved(factored(np.zeros((0, 0))), np.zeros(0)).shape == (0,)


def test_a_matrix_that_is_not_positive_definite_is_refused():
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        factored(np.diag([1.0, -1.0]))
