# SPDX-License-Identifier: BSD-3-Clause
"""Logs of robots: readers of recordings, quality checks, simulated logs with a hidden effect."""

from skidyn.datasets._embedded import load_demo_log
from skidyn.datasets._fetch import (
    fetch_double_pendulum,
    fetch_emps,
    fetch_panda_exciting,
    fetch_panda_gaz,
    fetch_screw_drive,
    fetch_xl330,
)
from skidyn.datasets._log import read_log
from skidyn.datasets._log_quality import JointQuality, LogQuality, check_log
from skidyn.datasets._recording import load_recording
from skidyn.datasets._robots import (
    load_panda,
    load_planar_arm,
    load_scara,
    load_srs_arm,
    load_ur5,
    load_ur10e,
)
from skidyn.datasets._simulator import hidden_effect_kinds, make_hidden_effect_log

__all__ = [
    "JointQuality",
    "LogQuality",
    "check_log",
    "fetch_double_pendulum",
    "fetch_emps",
    "fetch_panda_exciting",
    "fetch_panda_gaz",
    "fetch_screw_drive",
    "fetch_xl330",
    "hidden_effect_kinds",
    "load_demo_log",
    "load_panda",
    "load_planar_arm",
    "load_recording",
    "load_scara",
    "load_srs_arm",
    "load_ur5",
    "load_ur10e",
    "make_hidden_effect_log",
    "read_log",
]
