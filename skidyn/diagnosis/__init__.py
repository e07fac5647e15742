# SPDX-License-Identifier: BSD-3-Clause
"""Diagnosis: where a model fails, which physical effect it lacks, and what adding it does."""

from skidyn.diagnosis._diagnosis import Diagnosis, diagnose
from skidyn.diagnosis._effect_search import EffectSearchCV
from skidyn.diagnosis._failures import Comparison, Failure
from skidyn.diagnosis._findings import Finding
from skidyn.diagnosis._limits import Limit
from skidyn.diagnosis._search import Settings

__all__ = [
    "Comparison",
    "Diagnosis",
    "EffectSearchCV",
    "Failure",
    "Finding",
    "Limit",
    "Settings",
    "diagnose",
]
