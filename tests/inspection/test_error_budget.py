# SPDX-License-Identifier: BSD-3-Clause
"""Waterfall of the error."""

from types import SimpleNamespace

import numpy as np
import pytest

from skidyn.inspection import ErrorBudgetDisplay


def heights(display):
    return [bar.get_height() for bar in display.bars_]


def test_steps_and_rest_add_up(log, model, richer):
    display = ErrorBudgetDisplay.from_estimator({"zero": model, "half": richer}, log.X, log.y)
    first, change, rest = heights(display)
    assert first + change == pytest.approx(rest)
    assert display.rmse[0] == pytest.approx(np.sqrt(np.mean(log.y[:, 0] ** 2)))


def test_draws_the_history_of_a_diagnosis():
    diagnosis = SimpleNamespace(
        joint_names=("a", "slider"),
        history=[{"added": None, "rmse": [1.0, 4.0]}, {"added": "dahl", "rmse": [1.0, 2.0]}],
        noise_floor=np.array([0.5, 1.0]),
        comparison=SimpleNamespace(units=("N m", "N")),
    )
    display = ErrorBudgetDisplay.from_diagnosis(diagnosis, joint=2)
    assert heights(display) == pytest.approx([1.0, -0.75, 0.25])
    assert display.noise_line_.get_ydata()[0] == pytest.approx(1 / 16)
    assert display.unit == "N"
    assert display.noise_line_.get_label() == "noise floor 1 N"


def test_a_step_that_hurts_rises():
    tau = np.ones(10)
    display = ErrorBudgetDisplay.from_predictions(tau, {"a": 0 * tau, "worse": 3 * tau})
    assert heights(display)[1] > 0


def test_a_perfect_model_can_be_drawn():
    tau = np.ones(10)
    assert heights(ErrorBudgetDisplay.from_predictions(tau, {"a": tau}, noise_floor=0.1)) == [0, 0]


def test_needs_a_model():
    with pytest.raises(ValueError, match="at least one model"):
        ErrorBudgetDisplay.from_predictions(np.ones(3), {})
