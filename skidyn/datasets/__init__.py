# SPDX-License-Identifier: BSD-3-Clause
"""Logs of robots: readers of recordings, quality checks, simulated logs with a hidden effect."""

from skidyn.datasets._log import read_log
from skidyn.datasets._log_quality import JointQuality, LogQuality, check_log

__all__ = ["JointQuality", "LogQuality", "check_log", "read_log"]
