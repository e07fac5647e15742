# SPDX-License-Identifier: BSD-3-Clause
"""A fitted model in a notebook."""

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import Term
from skidyn.identification import RBDRegressor


def test_the_completed_model_shows_its_effects_in_a_notebook():
    log = make_hidden_effect_log(load_planar_arm(), "spring", joints=[2], n_trajectories=3)
    model = RBDRegressor(log.robot).with_effects([Term("spring", (2,))]).fit(log.X, log.y)
    html = model._repr_mimebundle_()["text/html"]
    assert "RBDRegressor" in html and "N m/rad" in html and "joint2 (2)" in html
