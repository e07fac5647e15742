# SPDX-License-Identifier: BSD-3-Clause
"""How sure a name is: the probability that it is right, set once with generated logs.

Two things tell: by how much of its gain the best other explanation falls short, and what is left on
its joints once it is added, in units of the noise. The weights were rounded by hand near those of a
logistic regression on 36 names of generated logs, and are not calibrated yet
(``benchmarks/diagnosis/confidence.py`` fits them and prints the reliability on other logs).
"""

from __future__ import annotations

import numpy as np

#: Weights of the constant, of the margin and of the logarithm of what is left over the noise.
CONSTANT, MARGIN, LEFT = 0.6, 4.0, -2.5
#: No name is surer than the number of logs on which the weights were found allows.
MOST = 0.98


def confidence(margin: float, left_over_noise: float) -> float:
    """Probability that a name is right.

    Parameters
    ----------
    margin : float
        Share of its gain that the best other explanation of the same joints falls short of.
    left_over_noise : float
        Held-out error of its joints with all findings, over their noise.

    Returns
    -------
    float
        Between 0 and 0.98.
    """
    logit = CONSTANT + MARGIN * min(max(margin, 0.0), 1.0)
    logit += LEFT * float(np.log(max(left_over_noise, 1.0)))
    return min(MOST, float(1 / (1 + np.exp(-logit))))
