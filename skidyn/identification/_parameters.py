# SPDX-License-Identifier: BSD-3-Clause
"""Refusal of parameters and of data without meaning for a model."""

from __future__ import annotations

from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from sklearn.utils.validation import _check_sample_weight

from skidyn._signals import Array
from skidyn.forward import Controller
from skidyn.identification._constraints import BodyConstraints
from skidyn.identification._estimators import ESTIMATORS, Estimator, find_estimator

if TYPE_CHECKING:
    from skidyn.identification._rbd_regressor import RBDRegressor


def keeps_no_rows(model: RBDRegressor) -> bool:
    """Whether evidence is enough for the estimator of a model."""
    if getattr(ESTIMATORS.get(model.estimator), "rows", False):
        raise AttributeError(
            f"estimator={model.estimator!r} needs single rows, which partial_fit does not keep; "
            "use fit, or another estimator"
        )
    return True


def checked_estimator(model: RBDRegressor) -> Estimator:
    """The estimator of a model; raises an error for parameters without effect."""
    if model.parameters not in ("identified", "nominal"):
        raise ValueError(f"parameters={model.parameters!r}; expected 'identified' or 'nominal'")
    if not isinstance(model.consistent, bool | np.bool_ | BodyConstraints):
        raise ValueError(
            f"consistent={model.consistent!r}; expected True, False or BodyConstraints(...)"
        )
    if not (model.smooth is None or isinstance(model.smooth, bool | np.bool_)):
        raise ValueError(f"smooth={model.smooth!r}; expected True, False or None")
    for name, none in (("forgetting", False), ("prior_std", True), ("horizon", True)):
        value = getattr(model, name)
        number = isinstance(value, Real) and not isinstance(value, bool | np.bool_)
        if not (number or (none and value is None)):
            raise ValueError(f"{name}={value!r}; expected a number{' or None' if none else ''}")
    if not 0 < model.forgetting <= 1:
        raise ValueError(f"forgetting={model.forgetting!r}; expected a weight above 0, up to 1")
    if model.prior_std is not None and not model.prior_std > 0:
        raise ValueError(f"prior_std={model.prior_std!r}; expected a number above 0, or None")
    if model.estimator == "entropic" and model.prior_std == np.inf:
        raise ValueError(
            "prior_std=inf leaves estimator='entropic' without a prior; give a finite number, "
            "None, or estimator='ordinary' with consistent=True"
        )
    return find_estimator(model.estimator)


def check_data(model: RBDRegressor, method: Estimator, instruments: Any, controller: Any) -> None:
    """Refuse data that the estimator of a model does not use."""
    if controller is not None and not isinstance(controller, Controller):
        raise ValueError(
            f"controller={controller!r}; expected a skidyn.simulation.Controller or None"
        )
    if controller is not None and not method.simulates:
        raise ValueError(
            f"estimator={model.estimator!r} does not accept a controller; 'output_error' does"
        )
    if instruments is not None and model.estimator != "instrumental":
        raise ValueError(
            f"estimator={model.estimator!r} does not accept instruments; 'instrumental' does"
        )


def checked_weight(sample_weight: Any, torque: Array, order: NDArray[np.int64]) -> Array | None:
    """Weights of the samples in some order, if there are any."""
    if sample_weight is None:
        return None
    weight = np.asarray(_check_sample_weight(sample_weight, torque, dtype=np.float64)[order])
    if np.any(weight < 0) or not np.any(weight > 0):
        raise ValueError(
            "sample_weight must not be negative, and not zero for all samples; "
            f"it lies between {weight.min():g} and {weight.max():g}"
        )
    return weight
