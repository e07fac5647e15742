# SPDX-License-Identifier: BSD-3-Clause
"""The description of a robot of another size."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import make_hidden_effect_log


def test_a_larger_robot_is_no_gain_of_its_torques(arm, told_of):
    log = make_hidden_effect_log(arm, None, n_trajectories=6, duration=8.0, random_state=3).frame
    size = 1.5
    powers = np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2]) + 3
    larger = replace(
        arm,
        tree=replace(arm.tree, translations=size * arm.tree.translations),
        inertial_parameters=size**powers * np.asarray(arm.inertial_parameters),
    )
    told = told_of(log, larger)["torque_scale"]
    assert told.suspicion == "the description is that of a robot of another size"
    words = told.evidence.split(" times its lengths")[0].split(" ")
    assert float(words[-1]) == pytest.approx(1 / size, rel=0.1)
    assert told.remedy is None


def test_currents_are_not_those_of_another_size(short, told_of):
    told = told_of(short.assign(tau1=short["tau1"] / 3, tau2=short["tau2"] / 3.3))["torque_scale"]
    assert told.remedy.option.startswith("--gain tau1=")
