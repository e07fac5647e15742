# SPDX-License-Identifier: BSD-3-Clause
"""Torque over time."""

import numpy as np
import pytest

from skidyn.inspection import TorqueDisplay


def test_shows_the_chosen_joint_and_its_error(log, model):
    display = TorqueDisplay.from_estimator(model, log.X, log.y, joint=2)
    assert display.rmse == pytest.approx(np.sqrt(np.mean(log.y[:, 1] ** 2)))
    assert "Joint 2" in display.ax_[0].get_title(loc="left")
    assert display.ax_[1].get_shared_x_axes().joined(*display.ax_)


def test_one_trajectory_can_be_picked(log, model):
    display = TorqueDisplay.from_estimator(model, log.X, log.y, trajectory=1)
    np.testing.assert_array_equal(display.measured, log.y[log.X["trajectory"] == 1, 0])
    with pytest.raises(ValueError, match="no trajectory 7; it has 1, 2"):
        TorqueDisplay.from_estimator(model, log.X, log.y, trajectory=7)


def test_no_line_runs_from_one_trajectory_to_the_next(log, model):
    display = TorqueDisplay.from_estimator(model, log.X, log.y)
    drawn = display.residual_line_.get_ydata()
    assert np.isnan(drawn).sum() == 1


def test_long_signals_are_thinned_without_losing_a_peak():
    tau = np.zeros((200_000, 1))
    tau[123_456] = 9.0
    display = TorqueDisplay.from_predictions(tau, 0 * tau)
    drawn = display.measured_line_.get_ydata()
    assert len(drawn) < 20_000
    assert np.nanmax(drawn) == 9.0


def test_existing_axes_are_used():
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(2, 1)
    tau = np.arange(10.0)
    display = TorqueDisplay.from_predictions(tau, tau, ax=axes)
    assert display.ax_[0] is axes[0]


def test_shapes_and_joints_are_checked():
    with pytest.raises(ValueError, match="y_true has shape"):
        TorqueDisplay.from_predictions(np.zeros((5, 2)), np.zeros((5, 3)))
    with pytest.raises(ValueError, match="joints are counted from 1 to 2"):
        TorqueDisplay.from_predictions(np.zeros((5, 2)), np.zeros((5, 2)), joint=0)
