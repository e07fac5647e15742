# SPDX-License-Identifier: BSD-3-Clause
"""How sure a name is: the probability that it is right, set once with generated logs.

What tells is by how much of its gain the best other explanation falls short; whether what is left
on its joints is white, as noise is, or slow, as the rest of a torque that was given a wrong name;
how much of the error it removes, and whether most of it stays; and whether something without a name
stays beside it. The weights are those of a logistic regression on names found in logs of other
seeds (``benchmarks/diagnosis/confidence.py``), held near round values; that of an error that mostly
stays was set by five collections of logs (``docs/user_guide/diagnosis_measured.rst``). The same
benchmark prints the reliability on other logs.
"""

from __future__ import annotations

import numpy as np

from skidyn._signals import Array

#: Weights of the constant, of the margin, of the logarithm of the inflation of the variance by
#: autocorrelation, of the decimal logarithm of the share of the error that is removed.
CONSTANT, MARGIN, CORRELATED, REMOVED = 2.4, 1.8, -1.1, 1.8
#: Weights of something without a name on the same joints, of folds that are blocks of time and not
#: recordings, of a kind on other joints that explains as much: one of the two; and of one on the
#: same joints that does, and is less simple.
NAMELESS, BLOCKS, ALIKE, EQUALLED = -1.3, -0.5, -2.4, -0.5
#: Weight of an effect that few recordings alone have, of which the plainest form alone was tried.
FEW = -0.6
#: Weight of an error that mostly stays on the joint where it was largest: more than this share of
#: what was above the noise, and so many times the noise. A third of such names are right.
STAYS, MOSTLY, ABOVE_NOISE = -1.7, 0.6, 1.2
#: Margin below which another explanation of the same joints equals a name, or explains so much
#: more; one that explains far more is of other joints, too.
EQUAL, ABOVE = 0.005, 0.1
#: Coloured noise inflates the variance so much; shares of the error between these count.
COLOURED, LEAST, ENOUGH = 1.7, 0.003, 0.3
#: No name is surer than the number of logs on which the weights were found allows.
MOST = 0.98
#: That something has no name is less sure: known effects have other formulas than the catalogue's.
#: So is a name that leaves most of an error.
MOST_NAMELESS = 0.88


def confidence(
    margin: float,
    inflation: float,
    removed: float,
    *,
    nameless: bool = False,
    whole_recordings: bool = True,
    alike: bool = False,
    rivalled: bool = False,
    few: bool = False,
    stays: bool = False,
    has_name: bool = True,
) -> float:
    """Probability that a name is right.

    Parameters
    ----------
    margin : float
        Share of its gain that the best other explanation of the same joints falls short of.
    inflation : float
        Inflation of the variance by the autocorrelation of what is left on its joints; 1 if white.
    removed : float
        Largest share of the squared error of a joint that the effect removes.
    nameless : bool, default=False
        Whether something without a name is left, or was found, on its joints.
    whole_recordings : bool, default=True
        Whether it was judged on whole recordings left out.
    alike : bool, default=False
        Whether a kind that acts on other joints explains the data equally well.
    rivalled : bool, default=False
        Whether the data cannot separate it from another explanation of its joints.
    few : bool, default=False
        Whether few recordings alone have it, and other forms of it were not tried there.
    stays : bool, default=False
        Whether most of the error above the noise stays on its joints (:func:`mostly_stays`).
    has_name : bool, default=True
        Whether it is a known effect, and not something without a name.

    Returns
    -------
    float
        Between 0 and 0.98, or 0.88 without a name or where most of the error stays.
    """
    logit = CONSTANT + MARGIN * min(max(margin, 0.0), 1.0)
    logit += CORRELATED * float(np.log(max(inflation / COLOURED, 1.0)))
    logit += REMOVED * float(np.log10(min(max(removed, LEAST), ENOUGH) / ENOUGH))
    logit += NAMELESS * nameless + BLOCKS * (not whole_recordings)
    logit += (
        STAYS * stays
        + FEW * few
        + ALIKE * alike
        + EQUALLED * (rivalled and -ABOVE < margin < EQUAL)
    )
    most = MOST if has_name and not stays else MOST_NAMELESS
    return min(most, float(1 / (1 + np.exp(-logit))))


def mostly_stays(before: Array, after: Array, noise: Array) -> bool:
    """Whether most of the error above the noise stays on the joint where it was largest.

    Parameters
    ----------
    before, after : ndarray of shape (n_joints,), N m or N
        Error of the joints of an effect without and with all findings.
    noise : ndarray of shape (n_joints,), N m or N
        Noise of these joints, with what all joints leave alike: noise that is correlated in time.

    Returns
    -------
    bool
    """
    above = np.maximum(np.square(before) - np.square(noise), 0.0)
    left = np.maximum(np.square(after) - np.square(noise), 0.0)
    j = int(np.argmax(above / np.maximum(np.square(noise), np.finfo(float).tiny)))
    return bool(left[j] > MOSTLY * above[j] and after[j] > ABOVE_NOISE * noise[j])
