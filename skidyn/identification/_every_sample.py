# SPDX-License-Identifier: BSD-3-Clause
"""Whether a model that was fitted to every sample shall take the place of one of averaged rows.

Rows that are averaged over short windows of motion hold little noise, and no samples at rest and
around reversals, of which the friction of sliding says nothing. A prediction is asked for
everywhere, however, and where friction is not quite what the model says, other coefficients leave
the least error over all samples. Least squares over samples has one weakness: noise in the
accelerations draws inertias towards zero. The errors of averages over short windows, in which such
noise is small, show it: they grow clearly.
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
    """Whether nothing in the model describes rest and reversals or needs neighbours in time."""
    return all(
        term.effect.family != "hysteresis" and "time" not in term.effect.needs and term.is_pointwise
        for term in terms
    )


def predicts_better(samples: PredictionBands, averaged: PredictionBands) -> bool:
    """Whether a fit of every sample predicts left-out folds better, and averages about as well.

    Parameters
    ----------
    samples, averaged : PredictionBands
        Of a model fitted to every sample, and of one fitted to averaged rows.
    """
    gain, of_averages = np.log(averaged.rmse / samples.rmse).mean(axis=1)
    return bool(gain > LEAST_GAIN and of_averages > -MOST_LOSS)
