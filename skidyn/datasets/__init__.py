# SPDX-License-Identifier: BSD-3-Clause
"""Robots, simulated logs with a hidden effect, and public recordings to download."""

from skidyn.datasets._embedded import load_demo_log
from skidyn.datasets._fetch import fetch_recording
from skidyn.datasets._robots import (
    load_panda,
    load_planar_arm,
    load_scara,
    load_srs_arm,
    load_ur5,
    load_ur10e,
)
from skidyn.datasets.hidden_effects import hidden_effect_kinds, make_hidden_effect_log
from skidyn.datasets.suite import SuiteCase, hidden_effect_suite, score_answers, wilson_interval

__all__ = [
    "SuiteCase",
    "fetch_recording",
    "hidden_effect_kinds",
    "hidden_effect_suite",
    "load_demo_log",
    "load_panda",
    "load_planar_arm",
    "load_scara",
    "load_srs_arm",
    "load_ur5",
    "load_ur10e",
    "make_hidden_effect_log",
    "score_answers",
    "wilson_interval",
]
