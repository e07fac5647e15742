# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of a model against measurements, as scikit-learn Display objects."""

from skidyn.inspection._error_budget import ErrorBudgetDisplay
from skidyn.inspection._error_map import ErrorMapDisplay
from skidyn.inspection._residual import ResidualDisplay
from skidyn.inspection._torque import TorqueDisplay

__all__ = ["ErrorBudgetDisplay", "ErrorMapDisplay", "ResidualDisplay", "TorqueDisplay"]
