# SPDX-License-Identifier: BSD-3-Clause
"""A suite of logs with hidden effects, made by another simulator, and its score."""

from skidyn.datasets.suite._score import score_answers, wilson_interval
from skidyn.datasets.suite._suite import SuiteCase, hidden_effect_suite

__all__ = [
    "SuiteCase",
    "hidden_effect_suite",
    "score_answers",
    "wilson_interval",
]
