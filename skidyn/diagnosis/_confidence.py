# SPDX-License-Identifier: BSD-3-Clause
"""How sure a name is: the probability that it is right, set once with generated logs.

Four things tell: by how much of its gain the best other explanation falls short, what is left on
its joints once it is added, in units of the noise, whether whole recordings could be left out to
judge it, and whether it acts in some recordings only. The weights are those of a logistic
regression on names found in logs of other seeds (``benchmarks/diagnosis/confidence.py``), whole
and cut down to one to five of their recordings, held near round values; the same benchmark
prints the reliability on other logs.
"""

from __future__ import annotations

import numpy as np

#: Weights of the constant, of the margin, of the logarithm of what is left over the noise, of
#: folds that are blocks of time and not recordings, and of an effect of some recordings only.
CONSTANT, MARGIN, LEFT, BLOCKS, SOME = 2.2, 1.5, -1.5, -1.0, -1.0
#: No name is surer than the number of logs on which the weights were found allows.
MOST = 0.98


def confidence(
    margin: float,
    left_over_noise: float,
    whole_recordings: bool = True,
    some_recordings: bool = False,
) -> float:
    """Probability that a name is right.

    Parameters
    ----------
    margin : float
        Share of its gain that the best other explanation of the same joints falls short of.
    left_over_noise : float
        Held-out error of its joints with all findings, over their noise.
    whole_recordings : bool, default=True
        Whether it was judged on whole recordings left out.
    some_recordings : bool, default=False
        Whether it acts in some of the recordings only.

    Returns
    -------
    float
        Between 0 and 0.98.
    """
    logit = CONSTANT + MARGIN * min(max(margin, 0.0), 1.0)
    logit += LEFT * float(np.log(max(left_over_noise, 1.0)))
    logit += BLOCKS * (not whole_recordings) + SOME * some_recordings
    return min(MOST, float(1 / (1 + np.exp(-logit))))
