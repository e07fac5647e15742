# SPDX-License-Identifier: BSD-3-Clause
"""A fitted model in a notebook."""

import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


@pytest.fixture(scope="module")
def missing():
    log = make_hidden_effect_log(load_planar_arm(), "spring", joints=[2])
    return diagnose(RBDRegressor(log.robot), log.X, log.y)


def test_the_completed_model_shows_its_effects_in_a_notebook(missing):
    html = missing.model._repr_mimebundle_()["text/html"]
    assert "RBDRegressor" in html and "N m/rad" in html and "joint2 (2)" in html
