# SPDX-License-Identifier: BSD-3-Clause
"""Designed motions as tables and files."""

import numpy as np
import pandas as pd

from skidyn.datasets import load_planar_arm
from skidyn.excitation import design_excitation
from skidyn.logs import read_log


def test_the_file_with_measured_torques_is_a_log(tmp_path):
    robot = load_planar_arm()
    excitation = design_excitation(robot, duration=6.0, iterations=0)

    excitation.to_csv(tmp_path / "motion.csv", rate=100.0)

    table = pd.read_csv(tmp_path / "motion.csv")
    time, q, dq, ddq = excitation.sample(100.0)
    torque = robot.inverse_dynamics(q, dq, ddq)
    table.assign(tau1=torque[:, 0], tau2=torque[:, 1]).to_csv(tmp_path / "log.csv", index=False)
    log = read_log(tmp_path / "log.csv", robot=robot)
    np.testing.assert_allclose(log["time"], time, atol=1e-12)
    for name, values in (("q", q), ("dq", dq), ("ddq", ddq), ("tau", torque)):
        np.testing.assert_allclose(log[[f"{name}1", f"{name}2"]], values, atol=1e-12)
