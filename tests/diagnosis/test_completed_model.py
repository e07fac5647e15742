# SPDX-License-Identifier: BSD-3-Clause
"""The next round of the loop: a model completed by its findings is diagnosed again."""

import pytest

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.explorer import Session
from skidyn.identification import RBDRegressor


@pytest.mark.parametrize(
    ("load", "kind"), [(load_planar_arm, "load_dependent_friction"), (load_ur5, "torque_gain")]
)
def test_a_completed_model_is_complete(load, kind):
    """Also where the effect's columns need the load or the torque of the model itself."""
    log = make_hidden_effect_log(load(), kind, joints=[2])
    model = RBDRegressor(log.robot, ("viscous", "coulomb"))
    first = diagnose(model, log.X, log.y)
    assert [(f.kind, f.joints) for f in first.findings] == [(kind, (2,))]
    completed = model.with_effects(first.findings[0].terms)
    second = diagnose(completed, log.X, log.y)
    assert second.verdict == "complete"
    assert second.rmse_before == pytest.approx(first.rmse_after, rel=0.1)
    assert Session(completed, log.X, log.y).history[0]["rmse"] is not None
