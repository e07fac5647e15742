# SPDX-License-Identifier: BSD-3-Clause
"""Diagnosis: where a model fails, which physical effect it lacks, and what adding it does."""

from skidyn.diagnosis._diagnosis import diagnose
from skidyn.diagnosis._effect_search import EffectSearchCV
from skidyn.diagnosis._failures import Comparison, Failure
from skidyn.diagnosis._findings import Finding
from skidyn.diagnosis._hypothesis import Settings
from skidyn.diagnosis._limits import Limit
from skidyn.diagnosis._out_of_core import Confirmation, ParquetDiagnosis, diagnose_parquet
from skidyn.diagnosis._proposal import Proposal
from skidyn.diagnosis._result import Diagnosis
from skidyn.diagnosis._separation import SeparatingMotion, design_separating_motion
from skidyn.diagnosis._unknown import UnknownTorque
from skidyn.diagnosis._variables import VariableTest

__all__ = [
    "Comparison",
    "Confirmation",
    "Diagnosis",
    "EffectSearchCV",
    "Failure",
    "Finding",
    "Limit",
    "ParquetDiagnosis",
    "Proposal",
    "SeparatingMotion",
    "Settings",
    "UnknownTorque",
    "VariableTest",
    "design_separating_motion",
    "diagnose",
    "diagnose_parquet",
]
