# SPDX-License-Identifier: BSD-3-Clause
"""Evidence: what identification and diagnosis need from a log, averaged once into few rows."""

from skidyn.evidence._evidence import Evidence

__all__ = ["Evidence"]
