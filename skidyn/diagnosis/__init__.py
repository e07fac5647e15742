# SPDX-License-Identifier: BSD-3-Clause
"""Diagnosis: where a model fails, missing physical effects, and the benefit of adding them."""

from skidyn.diagnosis._comparison import Comparison
from skidyn.diagnosis._diagnosis import diagnose
from skidyn.diagnosis._effect_search import EffectSearchCV
from skidyn.diagnosis._failures import Failure, Place, RestError
from skidyn.diagnosis._findings import Finding
from skidyn.diagnosis._limits import Limit
from skidyn.diagnosis._out_of_core import Confirmation, ParquetDiagnosis, diagnose_parquet
from skidyn.diagnosis._proposal import Proposal
from skidyn.diagnosis._result import Diagnosis
from skidyn.diagnosis._rule import Settings
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
    "Place",
    "Proposal",
    "RestError",
    "SeparatingMotion",
    "Settings",
    "UnknownTorque",
    "VariableTest",
    "design_separating_motion",
    "diagnose",
    "diagnose_parquet",
]

# For other packages of skidyn; no part of the public interface.
from skidyn.diagnosis._blocks import variance_inflation as variance_inflation
from skidyn.diagnosis._candidates import (
    Candidate as Candidate,
    catalogue_candidates as catalogue_candidates,
)
from skidyn.diagnosis._comparison import (
    REGIMES as REGIMES,
    error_map as error_map,
    regimes as regimes,
)
from skidyn.diagnosis._confidence import confidence as confidence
from skidyn.diagnosis._diagnosis import own_terms as own_terms
from skidyn.diagnosis._findings import notes as notes
from skidyn.diagnosis._intervals import parameter_intervals as parameter_intervals
from skidyn.diagnosis._profile import refine as refine
from skidyn.diagnosis._remainder import noise_level as noise_level
from skidyn.diagnosis._screen import CANDIDATE_RIDGE as CANDIDATE_RIDGE
from skidyn.diagnosis._separation import (
    findings_to_separate as findings_to_separate,
    separable_rivals as separable_rivals,
)
from skidyn.diagnosis._spectrum import find_lines as find_lines
from skidyn.diagnosis._split import split_effects as split_effects
from skidyn.diagnosis._story import SAME as SAME
