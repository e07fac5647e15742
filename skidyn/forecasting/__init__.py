# SPDX-License-Identifier: BSD-3-Clause
"""One-step-ahead forecasts of a signal from its own past, as baselines."""

from skidyn.forecasting._forecast import (
    AutoregressiveRegressor,
    PersistenceRegressor,
    forecast_table,
)

__all__ = ["AutoregressiveRegressor", "PersistenceRegressor", "forecast_table"]
