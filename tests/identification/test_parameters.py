# SPDX-License-Identifier: BSD-3-Clause
"""Parameters and data without meaning are refused, with what was expected."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.identification import RBDRegressor
from skidyn.simulation import Controller

ROBOT = load_planar_arm()
X = np.random.default_rng(0).uniform(-2, 2, (200, 6))
y = ROBOT.inverse_dynamics(X[:, :2], X[:, 2:4], X[:, 4:])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"consistent": "yes"}, "True, False or BodyConstraints"),
        ({"smooth": "x"}, "True, False or None"),
        ({"forgetting": "a"}, "expected a number"),
        ({"forgetting": True}, "expected a number"),
        ({"horizon": "x"}, "expected a number or None"),
        ({"estimator": ["ridge"]}, "expected one of 'weighted'"),
        ({"effects": "viscous"}, r"effects=\['viscous'\]"),
        ({"effects": None}, "expected a list"),
        ({"effects": [3]}, "3 is not an effect"),
        ({"effects": [("viscous", ["a"])]}, "joints counted from 1"),
        ({"effects": [("viscous", [0])]}, "no joint 0; the robot has joints 1 to"),
        ({"robot": 5}, "5 describes no robot"),
    ],
)
def test_parameters_of_another_kind_are_refused(wrong, message):
    with pytest.raises(ValueError, match=message):
        RBDRegressor(**({"robot": ROBOT} | wrong)).fit(X, y)


@pytest.mark.parametrize(
    ("estimator", "data", "message"),
    [
        ("weighted", {"controller": Controller(10.0, 1.0)}, "'output_error' does"),
        ("output_error", {"controller": "PD"}, "expected a skidyn.simulation.Controller"),
        ("weighted", {"instruments": X}, "instruments"),
    ],
)
def test_data_that_the_estimator_does_not_use_is_refused(estimator, data, message):
    with pytest.raises(ValueError, match=message):
        RBDRegressor(ROBOT, estimator=estimator).fit(X, y, **data)
