# SPDX-License-Identifier: BSD-3-Clause
"""Error by joint and regime."""

from types import SimpleNamespace

import numpy as np

from skidyn.effects import Signals
from skidyn.inspection import ErrorMapDisplay


def test_error_shows_in_the_regime_where_it_occurs():
    time = np.arange(0, 20, 0.01)
    q, dq = np.sin(time)[:, None], np.cos(time)[:, None]
    signals = Signals(q, dq, -q, np.zeros(len(time), dtype=int), time)
    residual = np.where(np.abs(dq) > 0.9, 1.0, 0.0)
    display = ErrorMapDisplay.from_predictions(residual, 0 * residual, signals=signals)
    found = dict(zip(display.regimes, display.errors[0], strict=True))
    assert found["fast"] > 0.7
    assert found["slow"] == found["rest"] == 0
    assert display.text_[0, display.regimes.index("slow")].get_text() == "0"


def test_rows_carry_the_names_of_the_joints(log, model):
    display = ErrorMapDisplay.from_estimator(model, log.X, log.y)
    labels = [text.get_text() for text in display.ax_.get_yticklabels()]
    assert labels == [f"{j + 1}  {name}" for j, name in enumerate(log.robot.joint_names)]


def test_a_regime_that_does_not_occur_is_left_open():
    display = ErrorMapDisplay([[1.0, np.nan]], [1.0], ["a"], ["slow", "rest"]).plot()
    assert display.text_[0, 1].get_text() == "–"


def test_draws_a_diagnosis_before_and_after():
    comparison = SimpleNamespace(rmse=lambda: np.array([2.0]))
    better = SimpleNamespace(rmse=lambda: np.array([1.0]))
    diagnosis = SimpleNamespace(
        comparison=comparison, comparison_after=better, joint_names=("a",), regimes=("fast",),
        error_map=lambda after: np.array([[1.0 if after else 2.0]]),
    )  # fmt: skip
    assert ErrorMapDisplay.from_diagnosis(diagnosis).errors[0, 0] == 2.0
    assert ErrorMapDisplay.from_diagnosis(diagnosis, after=True).errors[0, 0] == 1.0
