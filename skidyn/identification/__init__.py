# SPDX-License-Identifier: BSD-3-Clause
"""Identification of rigid bodies with effects: estimators, priors, consistency, uncertainty."""

from skidyn.identification._consistency import is_consistent, make_consistent
from skidyn.identification._constraints import BodyConstraints
from skidyn.identification._from_evidence import regressor_from_evidence
from skidyn.identification._instrumental import repetition_instruments
from skidyn.identification._rbd_regressor import RBDRegressor
from skidyn.identification._uncertainty import bootstrap_coefficients

__all__ = [
    "BodyConstraints",
    "RBDRegressor",
    "bootstrap_coefficients",
    "is_consistent",
    "make_consistent",
    "regressor_from_evidence",
    "repetition_instruments",
]

# For other packages of skidyn and for new estimators; no part of the public interface.
from skidyn.identification._consistency import (
    from_pseudo_inertia as from_pseudo_inertia,
    pseudo_inertia as pseudo_inertia,
)
from skidyn.identification._estimators import ESTIMATORS as ESTIMATORS, Estimator as Estimator
from skidyn.identification._from_evidence import weighted_solution as weighted_solution
from skidyn.identification._parameters import check_terms as check_terms
from skidyn.identification._recordings import (
    named_recordings as named_recordings,
    recognise as recognise,
    remember as remember,
)
from skidyn.identification._regression import Solution as Solution
from skidyn.identification._terms import find_terms as find_terms
