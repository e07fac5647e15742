# SPDX-License-Identifier: BSD-3-Clause
"""The estimators of RBDRegressor; a new one needs a function and a line in :data:`ESTIMATORS`.

An estimator is a function of a :class:`~skidyn.identification._regression.Regression` and of the
strength of the prior (None if it is to be found), and returns a
:class:`~skidyn.identification._regression.Solution`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from skidyn._signals import Array, scatter
from skidyn.identification._instrumental import instrumental
from skidyn.identification._priors import entropic, ridge
from skidyn.identification._regression import PASSES, Regression, Solution

#: Huber's constant (95 % efficiency on normal errors), degrees of freedom of Student's t, and
#: rounds of reweighting for either.
HUBER, DEGREES, REWEIGHTINGS = 1.345, 4.0, 15


@dataclass(frozen=True)
class Estimator:
    """An estimator of coefficients.

    ``solve(regression, prior_std)`` returns a Solution. ``rows``: single rows are needed, so that
    evidence is not enough. ``whole``: base parameters that the data does not determine are
    estimated too, from a prior. ``simulates``: the solution is refined to fit the simulated motion
    to the log.
    """

    solve: Callable[[Regression, float | None], Solution]
    rows: bool = False
    whole: bool = False
    simulates: bool = False


def weighted(regression: Regression, prior_std: float | None = None) -> Solution:
    """Least squares with joints weighted by their noise, iterated."""
    if regression.fit is not None:
        coefficients, noise = regression.fit.coefficients, regression.fit.noise
        return Solution(coefficients, regression.left_out(noise), noise)
    noise = regression.own_noise()
    for _ in range(PASSES):
        coefficients = regression.solve(noise)
        noise = regression.noise(coefficients)
    return Solution(coefficients, regression.left_out(noise), noise)


def ordinary(regression: Regression, prior_std: float | None = None) -> Solution:
    """Least squares with equal weights for all rows of all joints."""
    equal = np.ones(len(regression.design))
    coefficients = regression.solve(equal)
    return Solution(coefficients, regression.left_out(equal), regression.noise(coefficients))


def robust(regression: Regression, prior_std: float | None = None) -> Solution:
    """Student's t distribution of the rows' errors, started from Huber's estimate.

    Huber's problem is convex and finds the majority of the rows from any start; Student's weights
    then remove broken rows almost completely. Scales are median absolute deviations per joint.
    """
    coefficients = weighted(regression).coefficients
    for weigh in (_huber, _student):
        for _ in range(REWEIGHTINGS):
            residual = regression.residual(coefficients)
            noise = np.array([_scale(r) for r in residual])
            weights = [weigh(r / s) for r, s in zip(residual, noise, strict=True)]
            coefficients = regression.weighted(weights).solve(noise)
    left_out = regression.weighted(weights).left_out(noise)
    return Solution(coefficients, left_out, noise, attributes={"row_weights_": weights})


def _scale(residual: Array) -> float:
    return float(scatter(residual)) + 1e-100 if len(residual) else 1.0


def _huber(z: Array) -> Array:
    return np.minimum(1.0, HUBER / np.maximum(np.abs(z), 1e-300))


def _student(z: Array) -> Array:
    return (DEGREES + 1) / (DEGREES + z**2)


#: All estimators by name.
ESTIMATORS: dict[str, Estimator] = {
    "weighted": Estimator(weighted),
    "ordinary": Estimator(ordinary),
    "robust": Estimator(robust, rows=True),
    "ridge": Estimator(ridge, whole=True),
    "entropic": Estimator(entropic, whole=True),
    "instrumental": Estimator(instrumental, rows=True),
    "output_error": Estimator(weighted, rows=True, simulates=True),
}


def find_estimator(name: str) -> Estimator:
    """The estimator with a name; a ValueError if there is none."""
    if not isinstance(name, str) or name not in ESTIMATORS:
        raise ValueError(f"estimator={name!r}; expected one of {', '.join(map(repr, ESTIMATORS))}")
    return ESTIMATORS[name]
