# SPDX-License-Identifier: BSD-3-Clause
"""Tables of a fitted model's coefficients."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor


@pytest.fixture(scope="module")
def model():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=3.0)
    return RBDRegressor(log.robot).fit(log.X, log.y)


def test_every_coefficient_stands_in_the_table_with_its_error(model):
    table = model.parameter_table()
    assert [row["name"] for row in table] == model.coef_names_
    np.testing.assert_array_equal([row["value"] for row in table], model.coef_)
    np.testing.assert_array_equal([row["std"] for row in table], model.coef_std_)


def test_a_test_of_instruments_needs_instruments(model):
    with pytest.raises(SkidynError, match="requires a fit"):
        model.durbin_wu_hausman()


def test_a_ratio_below_one_has_no_meaning(model):
    with pytest.raises(ValueError, match="expected 1 or more"):
        model.essential_parameters(ratio=0.5)
