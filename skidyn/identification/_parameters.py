# SPDX-License-Identifier: BSD-3-Clause
"""Refusal of parameters and of data without meaning for a model."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from sklearn.utils.validation import _check_sample_weight

from skidyn._exceptions import EffectError
from skidyn._signals import Array, Signals
from skidyn.effects import Term
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


def in_weighted_trajectories(signals: Signals, weight: Array) -> NDArray[np.intp]:
    """Rows of the trajectories that have a sample with a weight, since the others count nothing."""
    _, place = np.unique(signals.trajectory, return_inverse=True)
    return np.flatnonzero(np.bincount(place, weight)[place] > 0)


def check_terms(terms: Iterable[Term], signals: Signals) -> None:
    """Refuse effects whose signals the log lacks, or whose shape only a diagnosis searches."""
    for term in terms:
        effect = term.effect
        if "temperature" in effect.needs and signals.temperature is None:
            raise EffectError(
                f"{term.kind} needs joint temperatures, which X lacks: add the columns temp1 .. "
                f"temp{signals.n_joints}, degrees Celsius, or leave the effect out"
            )
        if "time" in effect.needs and signals.time is None:
            raise EffectError(
                f"{term.kind} needs times, which X lacks: add the column time, s, or leave the "
                "effect out"
            )
        if term.is_open and effect.search == "spectrum":
            name = effect.shapes[0].name
            raise EffectError(
                f"{term.kind} needs its shape parameter {name}, which a fit does not search: give "
                f"Term({term.kind!r}, {list(term.joints)}, {{{name!r}: ...}}); "
                "skidyn.diagnosis.diagnose finds it"
            )
