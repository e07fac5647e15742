# SPDX-License-Identifier: BSD-3-Clause
"""Logs of robots: readers, column names, clock, units and checks."""

from skidyn.logs._files import Channel
from skidyn.logs._formats import register_reader
from skidyn.logs._quality import JointQuality, LogQuality, check_log
from skidyn.logs._read import read_log
from skidyn.logs._recording import load_recording

__all__ = [
    "Channel",
    "JointQuality",
    "LogQuality",
    "check_log",
    "load_recording",
    "read_log",
    "register_reader",
]

# For other packages of skidyn.
from skidyn.logs._folders import files_of as files_of
