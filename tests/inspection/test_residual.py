# SPDX-License-Identifier: BSD-3-Clause
"""Residual against a signal."""

import numpy as np
import pytest

from skidyn.diagnosis import Finding
from skidyn.inspection import ResidualDisplay


def finding(joints=(1, 2)):
    x = np.linspace(-1, 1, 11)
    curves = [
        {"joint": j, "variable": f"dq{j}", "unit": "rad/s", "x": x, "effect": j * x,
         "measured": j * x, "low": j * x - 1, "high": j * x + 1}
        for j in joints
    ]  # fmt: skip
    return Finding(
        "viscous", "Viscous friction", joints, {}, (), 0.5, 0.0, (), "", "", "", (), curves=curves
    )


@pytest.mark.parametrize(
    ("against", "label"),
    [("dq", "dq2 (rad/s)"), ("q1", "q1 (rad)"), ("ddq", "ddq2 (rad/s²)"), ("time", "time (s)")],
)
def test_draws_against_any_signal_of_the_log(log, model, against, label):
    display = ResidualDisplay.from_estimator(model, log.X, log.y, joint=2, against=against)
    assert display.ax_.get_xlabel() == label
    np.testing.assert_allclose(display.residual, log.y[:, 1])


def test_a_signal_that_is_not_logged_is_an_error(log, model):
    with pytest.raises(ValueError, match="no such signal; it has q, dq, ddq and time"):
        ResidualDisplay.from_estimator(model, log.X, log.y, against="temp")


def test_curve_of_a_richer_model_is_what_it_adds(log, model, richer):
    display = ResidualDisplay.from_estimator(model, log.X, log.y, candidate=richer)
    np.testing.assert_allclose(display.curve_line_.get_ydata(), 0.5)


def test_median_follows_the_residual():
    x = np.linspace(-1, 1, 1000)
    display = ResidualDisplay.from_predictions(3 * x, 0 * x, against=x)
    middle = display.median_line_
    np.testing.assert_allclose(middle.get_ydata(), 3 * middle.get_xdata(), atol=0.1)


def test_draws_a_finding():
    display = ResidualDisplay.from_finding(finding(), joint=2)
    assert display.curve_line_.get_label() == "Viscous friction"
    np.testing.assert_allclose(display.curve_line_.get_ydata()[-1], 2.0)
    with pytest.raises(ValueError, match="no curve for joint 3; it has: 1, 2"):
        ResidualDisplay.from_finding(finding(), joint=3)


def test_signal_must_have_a_value_per_sample():
    with pytest.raises(ValueError, match=r"against has shape \(4,\)"):
        ResidualDisplay.from_predictions(np.zeros(5), np.zeros(5), against=np.zeros(4))
