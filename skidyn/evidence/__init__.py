# SPDX-License-Identifier: BSD-3-Clause
"""Evidence: what identification and diagnosis need from a log, averaged once into few rows."""

from skidyn.evidence._evidence import Evidence
from skidyn.evidence._from_motion import evidence_from_motion
from skidyn.evidence._streaming import evidence_from_parquet

__all__ = ["Evidence", "evidence_from_motion", "evidence_from_parquet"]
