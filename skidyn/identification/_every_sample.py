# SPDX-License-Identifier: BSD-3-Clause
"""Choice between a model fitted to every sample and one fitted to averaged rows.

Rows averaged over short windows of motion contain little noise, and no samples at rest and around
reversals, which sliding friction does not describe. A prediction is needed for all samples,
however, and if friction differs from the model, other coefficients have the least error over all
samples. Least squares over samples has one weakness: noise in the accelerations biases inertias
towards zero. The errors of averages over short windows, in which such noise is small, then grow
clearly.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from skidyn.effects import Term
from skidyn.identification._uncertainty import PredictionBands

#: The error of left-out samples must fall by this share at least, in the mean over the joints; that
#: of averages may grow by so much: then what noise has changed is below a fifth of the error.
LEAST_GAIN, MOST_LOSS = 0.005, 0.02


def may_take_samples(terms: Iterable[Term]) -> bool:
    """Whether no effect describes rest and reversals or needs neighbours in time."""
    return all(
        term.effect.family != "hysteresis" and "time" not in term.effect.needs and term.is_pointwise
        for term in terms
    )


def predicts_better(samples: PredictionBands, averaged: PredictionBands) -> bool:
    """Whether a fit of every sample predicts left-out folds better, and averages about as well."""
    gain, of_averages = np.log(averaged.rmse / samples.rmse).mean(axis=1)
    return bool(gain > LEAST_GAIN and of_averages > -MOST_LOSS)
