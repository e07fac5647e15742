# SPDX-License-Identifier: BSD-3-Clause
import numpy as np

from skidyn.evidence import independent_columns, regressor_rows


def test_rows_reproduce_the_torque_of_the_rigid_body(planar_problem):
    made = planar_problem(2)
    robot, s = made.signals.robot, made.signals
    torque = robot.inverse_dynamics(s.q, s.dq, s.ddq)
    (by_joint,) = regressor_rows([made], np.arange(10 * robot.n_bodies))
    for j, rows in enumerate(by_joint):
        averaged = made.rows.average(torque[:, j], j)
        np.testing.assert_allclose(rows @ robot.inertial_parameters.ravel(), averaged, atol=1e-9)


def test_columns_that_others_determine_or_nothing_moves_are_left_out():
    rows = np.random.default_rng(0).normal(size=(40, 3))
    rows = np.column_stack([rows, rows[:, 0] - rows[:, 1], np.zeros(40)])
    shown = independent_columns(rows)
    assert len(shown) == 3 and 4 not in shown
    assert np.linalg.matrix_rank(rows[:, shown]) == 3
