# SPDX-License-Identifier: BSD-3-Clause
"""Bodies that cannot exist are refused."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_scara
from skidyn.effects import Term
from skidyn.export import write_mjcf, write_urdf


def test_impossible_bodies_are_refused_by_name(tmp_path):
    robot = load_scara()
    for body, column, message in (
        (1, 0, "'link2' has a mass of -1"),
        (2, 4, "'quill' has the principal moments"),
    ):
        parameters = robot.inertial_parameters.copy()
        parameters[body, column] = -1.0
        with pytest.raises(ValueError, match=message):
            write_urdf(replace(robot, inertial_parameters=parameters), tmp_path / "x")
    assert not (tmp_path / "x").exists()


def test_a_spring_of_some_recordings_is_not_written_for_all(fit, tmp_path):
    model = fit(load_scara(), ["viscous"], consistent=True)
    spring = Term("spring", (1,), {"trajectories": (0,)})
    model.effect_terms_ = type(model.effect_terms_)([*model.effect_terms_, spring])
    model.effect_coefficients_[spring] = np.array([3.0, 0.0])
    assert write_mjcf(model, tmp_path / "robot.xml") == ("spring of joint1",)
