# SPDX-License-Identifier: BSD-3-Clause
"""What a log says and does not say, in numbers and in words."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.exceptions import SkidynError
from skidyn.identification import RBDRegressor

ROBOT = load_planar_arm()


def fitted(X, **options):
    y = ROBOT.inverse_dynamics(X[:, :2], X[:, 2:4], X[:, 4:]) + 0.3 * X[:, 2:4]
    y += np.random.default_rng(1).normal(0, 0.05, y.shape)
    return RBDRegressor(ROBOT, ("viscous", "coulomb"), **options).fit(X, y)


def test_rich_motion_leaves_nothing_open():
    model = fitted(np.random.default_rng(0).uniform(-2, 2, (500, 6)))
    assert 1 <= model.condition_number_ < 20
    assert model.open_combinations() == []


def test_one_speed_cannot_tell_viscous_from_dry_friction():
    X = np.random.default_rng(0).uniform(-2, 2, (500, 6))
    X[:, 2] = np.sign(X[:, 2]) * 1.5
    model = fitted(X)
    found = model.open_combinations()
    assert len(found) == 1 and model.condition_number_ > 1e10
    direction = found[0]["combination"]
    assert set(direction) == {"viscous.Fv[1]", "coulomb.Fc[1]"}
    np.testing.assert_allclose(
        direction["coulomb.Fc[1]"] / direction["viscous.Fv[1]"], -1.5, rtol=1e-3
    )
    assert "owering" in found[0]["sentence"]


def test_a_joint_at_rest_is_told():
    X = np.random.default_rng(0).uniform(-2, 2, (500, 6))
    X[:, [0, 2, 4]] = 0.0
    model = fitted(X)
    assert model.condition_number_ == np.inf
    sentences = [row["sentence"] for row in model.open_combinations()]
    assert "viscous.Fv[1] causes no torque in this data." in sentences


def test_essential_parameters_explain_as_much():
    model = fitted(np.random.default_rng(0).uniform(-2, 2, (500, 6)))
    essential = model.essential_parameters()
    kept = {row["name"]: row["value"] for row in essential["parameters"]}
    # There is no dry friction in the data.
    assert {"coulomb.Fc[1]", "coulomb.Fc[2]"} <= set(essential["eliminated"])
    assert len(kept) + len(essential["eliminated"]) == len(model.coef_)
    assert kept["viscous.Fv[1]"] == pytest.approx(0.3, abs=0.02)
    assert 1 <= essential["error_ratio"] < 1.02
    assert len(model.essential_parameters(ratio=1e9)["parameters"]) == len(model.coef_)
    with pytest.raises(ValueError, match="ratio"):
        model.essential_parameters(ratio=0.5)


def test_effects_alone_have_answers_too():
    X = np.random.default_rng(0).uniform(-2, 2, (300, 6))
    model = fitted(X, parameters="nominal")
    assert model.condition_number_ < 20 and model.open_combinations() == []
    names = [row["name"] for row in model.essential_parameters()["parameters"]]
    assert names == ["viscous.Fv[1]", "viscous.Fv[2]"]
    with pytest.raises(SkidynError, match="instrumental"):
        model.durbin_wu_hausman()
